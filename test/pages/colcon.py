"""Stands in for `colcon build` in docs/tutorial.md: builds the packages in src/ with the generators of rosidl and the C compiler,
as test/interop/ros/packages.py does, and writes install/setup.sh, by which programs of ROS 2 find them."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "interop/ros"))
import packages  # noqa: E402

assert sys.argv[1:] == ["build"]
build, install = pathlib.Path("build").resolve(), pathlib.Path("install")
build.mkdir()
install.mkdir()
packages.build(pathlib.Path("src").resolve(), build)
libraries = ":".join(str(folder) for folder in sorted(build.iterdir()) if folder.is_dir())
(install / "setup.sh").write_text(f"export PYTHONPATH={build}:$PYTHONPATH LD_LIBRARY_PATH={libraries}:$LD_LIBRARY_PATH\n")
print("Summary: the packages are built")
