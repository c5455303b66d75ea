"""ROS packages as `trestle generate --to msg` writes them, made importable for rclpy: what colcon does with them, by the
generators of rosidl and the C compiler.

Needs gcc, g++ and Python's headers; the headers and libraries of the packages that are used come with what is installed.
"""
import concurrent.futures
import ctypes
import json
import os
import pathlib
import subprocess
import sys
import sysconfig

from rosidl_generator_c import generate_c
from rosidl_generator_py import generate_py
from rosidl_typesupport_c import generate_c as generate_type_support_c
from rosidl_typesupport_fastrtps_c import generate_typesupport_fastrtps_c
from rosidl_typesupport_introspection_c import generate_c as generate_introspection_c

import golden

FAST, INTROSPECTION = "rosidl_typesupport_fastrtps_c", "rosidl_typesupport_introspection_c"


def can_build():
    """What is missing for it; nothing: it can."""
    return None if pathlib.Path(sysconfig.get_path("include"), "Python.h").exists() else "Python.h (libpython3-dev)"


def generate(folder, share):
    """Has rosidl write structures, type support and Python modules beside the IDL files in `folder`."""
    files = [str(file.relative_to(folder)) for file in sorted(folder.glob("*/*.idl"))]
    arguments = {
        "package_name": folder.name, "target_dependencies": [],
        "idl_tuples": [f"{folder}:{file}" for file in files],
        "type_description_tuples": [f"{file}:{(folder / file).with_suffix('.json')}" for file in files],
        "ros_interface_files": [],
        "include_paths": [f"{one.name}:{one}" for root in (share, folder.parent) for one in root.iterdir()]}
    # Two generators have files of the same names.
    apart = folder / "introspection" / folder.name
    apart.mkdir(parents=True)
    for generator, into, run in (
            ("rosidl_generator_c", folder, generate_c), (FAST, folder, generate_typesupport_fastrtps_c),
            (INTROSPECTION, apart, generate_introspection_c),
            ("rosidl_typesupport_c", folder, lambda file: generate_type_support_c(file, [FAST, INTROSPECTION])),
            ("rosidl_generator_py", folder, lambda file: generate_py(file, ["rosidl_typesupport_c"]))):
        templates = share / generator / "resource"
        file = folder / "arguments.json"
        file.write_text(json.dumps({**arguments, "template_dir": str(templates), "output_dir": str(into)}))
        run(str(file))
        for template in templates.glob("*visibility_control*.in"):
            text = template.read_text().replace("@PROJECT_NAME@", folder.name)
            header = into / "msg" / template.stem
            header.parent.mkdir(exist_ok=True)
            header.write_text(text.replace("@PROJECT_NAME_UPPER@", folder.name.upper()))
    (folder / "__init__.py").touch()


def together(folder):
    """The sources of a package. Those in C++ are included by one file of each kind, which saves the compiler most of its
    work; those in C have static names in common."""
    for kind in ("type_support", "type_support_c"):
        source = folder / f"all_{kind}.cpp"
        source.write_text("".join(f'#include "{file}"\n' for file in sorted(folder.rglob(f"*__{kind}.cpp"))))
        yield source
    yield from sorted(folder.rglob("*.c"))


def link(folder, objects, libraries, prefix):
    """All of a package in one library, which is its Python extension as well. Its type support is looked for in two other
    libraries, by their names: these are empty and lead to the first one."""
    library = folder / f"{folder.name}_s__rosidl_typesupport_c.so"
    paths = [f"-Wl,-rpath,{path}" for path in (prefix / "lib", folder.parent)]
    subprocess.run(["g++", "-shared", "-o", library, *objects, *libraries, *paths], check=True)
    for kind in (FAST, INTROSPECTION):
        name = f"lib{folder.name}__{kind}.so"
        subprocess.run(["g++", "-shared", "-o", folder / name, f"-Wl,-soname,{name}", "-Wl,--no-as-needed", library, *paths],
                       check=True)
        ctypes.CDLL(folder / name)  # a library that is loaded is found by its name
    return library


def build(sources, work):
    """Makes the packages in the folder `sources` importable, with `work` for what is made of them; returns the hashes of
    their types."""
    prefix = pathlib.Path(sys.prefix)
    share = prefix / "share"
    hashes = golden.hashes_of_folders([sources], share, work)  # leaves their IDL files in `work`
    packages = {folder.name: folder for folder in sorted(work.iterdir()) if folder.is_dir()}
    for folder in packages.values():
        generate(folder, share)
    numpy = subprocess.run([sys.executable, "-c", "import numpy; print(numpy.get_include())"], stdout=subprocess.PIPE,
                           text=True, check=True).stdout.strip()
    includes = [f"-I{path}" for path in (
        work, *(folder / "introspection" for folder in packages.values()), sysconfig.get_path("include"), numpy,
        prefix / "include", *sorted((prefix / "include").iterdir()))]

    def compiled(source):
        compiler = ["g++", "-std=c++17"] if source.suffix == ".cpp" else ["gcc"]
        target = source.with_suffix(source.suffix + ".o")
        subprocess.run([*compiler, "-O0", "-w", "-fPIC", *includes, "-c", source, "-o", target], check=True)
        return target

    sources = [source for folder in packages.values() for source in together(folder)]
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        objects = dict(zip(sources, pool.map(compiled, sources)))
    installed = [*(prefix / "lib").glob("librosidl_*.so"), prefix / "lib/librcutils.so", prefix / "lib/libfastcdr.so",
                 *(prefix / "lib").glob("lib*_interfaces__rosidl_*.so"), *(prefix / "lib").glob("libservice_msgs__rosidl_*.so")]
    done = {}  # in the order in which they use each other
    while len(done) < len(packages):
        ready = [folder for name, folder in packages.items() if name not in done and
                 all(used in done for used in uses(folder, packages))]
        if not ready:
            raise ValueError(f"these packages use each other: {packages.keys() - done.keys()}")
        for folder in ready:
            used = [done[name] for name in uses(folder, packages)]
            done[folder.name] = link(folder, [target for source, target in objects.items() if folder in source.parents],
                                     [*used, *installed], prefix)
    sys.path.insert(0, str(work))
    return hashes


def uses(folder, packages):
    """Which of the packages this one uses, by its IDL files."""
    texts = [file.read_text() for file in folder.glob("*/*.idl")]
    return [name for name in packages if name != folder.name and any(f'#include "{name}/' in text for text in texts)]
