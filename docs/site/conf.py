# What Sphinx is told of the site; make_site.py makes the pages that it reads, and runs it.
import os

project = "Trestle"
release = version = os.environ["TRESTLE_VERSION"]
html_title = f"Trestle {version}"
copyright = "the Trestle authors"  # the name is Sphinx's
extensions = ["myst_parser"]
source_suffix = {".md": "markdown"}
root_doc = "index"
myst_heading_anchors = 6
highlight_language = "none"
html_theme = "furo"
html_static_path = ["site.css"]
html_css_files = ["site.css"]
exclude_patterns = ["copied"]
html_show_sphinx = False
html_copy_source = html_show_sourcelink = False
# A block that no lexer of Pygments takes whole, as JSON with three dots in it, is shown without colours.
suppress_warnings = ["misc.highlighting_failure"]
