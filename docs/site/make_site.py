#!/usr/bin/env python3
"""make_site.py REFERENCE OUT: makes the site of the documentation in the folder OUT, by Sphinx with MyST, which reads Markdown as GitHub does.

Its pages are README.md, CONTRIBUTING.md, CHANGELOG.md and docs/. The tables of docs/README.md are its navigation. Links to other files
of the sources lead to copies of these, so that the site needs nothing else. REFERENCE is what Doxygen made, which is copied, too.

It fails when Sphinx warns, as it does of a link to what is not there and of a page that is not in the navigation; when a link or an
anchor of what came out leads nowhere; and when a page would load something from elsewhere.
"""
import collections
import html
import html.parser
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import urllib.parse

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGES = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"]
FENCE = re.compile(r"(^```.*?^```[^\n]*\n?)", re.DOTALL | re.MULTILINE)
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\[\]]*\](?:\([^()]*\))?)*)\]\(([^)\s]+)\)")


def version():
    """That of the sources, and the commit where there is one."""
    number = re.search(r"project\(trestle VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]

    def git(*arguments):
        return subprocess.run(["git", "-C", ROOT, *arguments], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
                              check=False).stdout.split()
    commit = git("rev-parse", "--short=8", "HEAD")
    return number if not commit or f"v{number}" in git("tag", "--points-at", "HEAD") else f"{number} ({commit[0]})"


def files():
    """Of the sources: what git has, or what there is where there is no git."""
    listed = subprocess.run(["git", "-C", ROOT, "ls-files", "--cached", "--others", "--exclude-standard"], stdout=subprocess.PIPE,
                            stderr=subprocess.DEVNULL, text=True, check=False).stdout.splitlines()
    return [one for one in listed if (ROOT / one).is_file()] or \
        [str(path.relative_to(ROOT)) for path in ROOT.rglob("*") if path.is_file() and "build" not in path.relative_to(ROOT).parts]


def target_of(page, link):
    """A link's path from the root of the sources, and its anchor; nothing for what is elsewhere."""
    if re.match(r"\w+:", link) or link.startswith("#"):
        return None
    path, _, anchor = link.partition("#")
    return os.path.normpath(os.path.join(os.path.dirname(page), path)), anchor


class Sources:
    """Copies of the files that pages link to, as text, and lists of what is in folders."""

    def __init__(self, folder):
        self.folder = folder
        self.all = files()

    def href(self, path):
        """Where in the site it is."""
        if (ROOT / path).is_dir():
            self.list_folder(path)
            return f"source/{path}/index.html"
        self.copy(path)
        return self.name(path)

    @staticmethod
    def name(path):
        return f"source/{path}" if path.endswith((".png", ".svg")) else f"source/{path}.txt"

    def copy(self, path):
        there = self.folder / self.name(path)
        there.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / path, there)

    def list_folder(self, path):
        inside = [one for one in self.all if one.startswith(f"{path}/")]
        for one in inside:
            self.copy(one)
        items = "".join(f'<li><a href="{os.path.relpath(self.name(one), f"source/{path}")}">{html.escape(one[len(path) + 1:])}</a></li>\n'
                        for one in inside)
        there = self.folder / "source" / path / "index.html"
        there.parent.mkdir(parents=True, exist_ok=True)
        there.write_text(f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{html.escape(path)}</title></head>\n'
                         f"<body><h1>{html.escape(path)}</h1>\n<ul>\n{items}</ul></body></html>\n")


def outside_code(text, change):
    """Changes what is not in a block of code."""
    return "".join(part if part.startswith("```") else change(part) for part in FENCE.split(text))


def for_site(page, text, pages, sources):
    """The text of a page with its links as the site has them."""
    up = "../" * page.count("/")

    def link(match):
        image, words, url = match.groups()
        words = LINK.sub(link, words)  # a picture that is a link
        found = target_of(page, url)
        if image or found is None or not (ROOT / found[0]).exists():
            return f"{image}[{words}]({url})"
        path, anchor = found
        if path == "README.md":
            return f"[{words}]({up}index.md{'#' + anchor if anchor else ''})"
        if path in pages:
            return f"[{words}]({url})"
        return f'<a href="{up}{sources.href(path)}">{words}</a>'
    return outside_code(text, lambda part: LINK.sub(link, part))


def navigation(text):
    """The sections of docs/README.md: of each its heading and its pages, with the words that lead to them."""
    sections = collections.OrderedDict()
    for heading, table in re.findall(r"^## (.*)\n((?:.*\n)*?)(?=^## |\Z)", text, re.MULTILINE):
        rows = [row for row in table.splitlines() if row.startswith("|")]
        found = [(words, target_of("docs/README.md", url)[0]) for row in rows
                 for _, words, url in LINK.findall(row.split("|")[1]) if target_of("docs/README.md", url)]
        sections[heading] = [(words, page) for words, page in found if page.endswith(".md")]
    return sections


def toctrees(sections):
    for heading, pages in sections.items():
        entries = "".join(f"{words[0].upper()}{words[1:]} <{page.removesuffix('.md')}>\n" for words, page in pages)
        yield f"```{{toctree}}\n:hidden:\n:caption: {heading}\n\n{entries}```\n"


def write_pages(folder, sources):
    """All that Sphinx reads."""
    pages = [*PAGES, *(str(path.relative_to(ROOT)) for path in sorted((ROOT / "docs").rglob("*.md"))
                       if path.parent.name != "reference")]
    for page in pages:
        text = for_site(page, (ROOT / page).read_text(), pages, sources)
        there = folder / ("index.md" if page == "README.md" else page)
        there.parent.mkdir(parents=True, exist_ok=True)
        if page == "README.md":
            text += "\n```{toctree}\n:hidden:\n\nAll pages <docs/README>\nAPI reference <reference>\nChanges <CHANGELOG>\n```\n"
            text += "".join(toctrees(navigation((ROOT / "docs/README.md").read_text())))
        there.write_text(text)
    for picture in (one for one in sources.all if one.startswith("docs/") and one.endswith((".png", ".svg"))):
        (folder / picture).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / picture, folder / picture)
    text = (ROOT / "docs/reference/main.md").read_text().replace("# Trestle: the public headers", "# API reference", 1)
    (folder / "reference.md").write_text(
        f'{text}\n<a href="reference/index.html">All classes, functions and files</a>, made from the comments of the headers.\n')
    return pages


class Links(html.parser.HTMLParser):
    """What a page of the site leads to, loads, and has as anchors; and what its navigation has."""

    def __init__(self, text):
        super().__init__()
        self.links, self.loads, self.anchors, self.navigation = [], [], set(), []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        if "id" in attrs:
            self.anchors.add(attrs["id"])
        if tag == "a" and attrs.get("href"):
            self.links.append(attrs["href"])
            if "reference" in attrs.get("class", "").split() and "internal" in attrs.get("class", "").split():
                self.navigation.append(attrs["href"])
        self.loads += [attrs[key] for key in ("src", "href") if attrs.get(key) and (key == "src" or tag == "link")]


def faults(site, pages):
    """What is wrong in what came out."""
    parsed = {path: Links(path.read_text()) for path in sorted(site.rglob("*.html"))
              if (site / "reference") not in path.parents and (site / "_static") not in path.parents}
    for path, page in parsed.items():
        where = path.relative_to(site)
        yield from (f"{where}: loads {url}" for url in page.loads if re.match(r"(\w+:)?//", url))
        for url in {*page.links, *page.loads}:
            if re.match(r"\w+:|//", url):
                continue
            file, _, anchor = url.partition("#")
            there = (path.parent / urllib.parse.unquote(file.partition("?")[0])).resolve() if file else path
            if there.is_dir():
                there /= "index.html"
            if not there.exists():
                yield f"{where}: {url}: no such file"
            elif anchor and there in parsed and urllib.parse.unquote(anchor) not in parsed[there].anchors:
                yield f"{where}: {url}: no such anchor"
    first = site / "index.html"
    reached = {(site / url.partition("#")[0]).resolve() for url in parsed[first].navigation}
    yield from (f"{page}: cannot be reached from the navigation" for page in pages
                if page != "README.md" and (site / page).with_suffix(".html").resolve() not in reached)


def finds_wrong_ones():
    """That the checks of what came out can fail."""
    with tempfile.TemporaryDirectory() as name:
        site = pathlib.Path(name).resolve()
        (site / "index.html").write_text('<a class="reference internal" href="a.html">A</a> <a href="gone.html">B</a>')
        (site / "a.html").write_text('<h1 id="here"></h1><a href="#here"></a><a href="index.html#gone"></a><img src="https://x/y.png">')
        (site / "b.html").write_text("")
        # A file, an anchor, a picture from elsewhere, a page that the navigation does not have.
        return len(list(faults(site, ["README.md", "a.md", "b.md"]))) == 4


def main():
    if not finds_wrong_ones():
        print("the checks themselves find no faults")
        return 1
    reference, out = (pathlib.Path(one).resolve() for one in sys.argv[1:])
    work = out.parent / "site-pages"
    for folder in (out, work):
        shutil.rmtree(folder, ignore_errors=True)
    work.mkdir(parents=True)
    for name in ("conf.py", "site.css"):
        shutil.copyfile(ROOT / "docs/site" / name, work / name)
    copied = work / "copied"
    sources = Sources(copied)
    pages = write_pages(work, sources)
    status = subprocess.run([sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-j", "auto", "-d", out.parent / "site-doctrees", work, out],
                            env={**os.environ, "TRESTLE_VERSION": version()}, check=False).returncode
    if status != 0:
        return 1
    shutil.copytree(copied / "source", out / "source")
    shutil.copytree(reference, out / "reference")
    found = list(faults(out, pages))
    print("\n".join(found) or f"{len(pages)} pages, without a fault")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
