"""Messages of packages that are not installed, serialized by rosidl's own type support: its generators write it, and the
C++ compiler makes a program of it that fills the messages with given values.

Needs g++; the headers and libraries of the packages that are used come with what is installed.
"""
import concurrent.futures
import json
import os
import subprocess

from rosidl_generator_c import generate_c
from rosidl_generator_cpp import generate_cpp
from rosidl_parser import definition as idl
from rosidl_parser.parser import parse_idl_file
from rosidl_pycommon import convert_camel_case_to_lower_case_underscore
from rosidl_typesupport_fastrtps_cpp import generate_cpp as generate_type_support

HEADERS = """#include <cstdio>
#include <type_traits>
#include <vector>
#include <fastcdr/Cdr.h>
"""
# Where rosidl leaves gaps before aligned numbers, the memory's zeros are seen.
SERIALIZE = """
template <typename Message, typename Serialize>
void print(const char* name, const Message& message, Serialize serialize) {
  std::vector<char> room(1 << 16);
  eprosima::fastcdr::FastBuffer buffer(room.data(), room.size());
  eprosima::fastcdr::Cdr cdr(buffer, eprosima::fastcdr::Cdr::DEFAULT_ENDIAN, eprosima::fastcdr::CdrVersion::XCDRv1);
  cdr.set_encoding_flag(eprosima::fastcdr::EncodingAlgorithmFlag::PLAIN_CDR);
  cdr.serialize_encapsulation();
  serialize(message, cdr);
  std::printf("%s ", name);
  for (std::size_t i = 0; i < cdr.get_serialized_data_length(); ++i) {
    std::printf("%02x", static_cast<unsigned char>(room[i]));
  }
  std::puts("");
}
"""


def messages_of(definition):
    """The structures that rosidl makes of a file: of a message one, of services and actions their parts."""
    if isinstance(definition, idl.Message):
        return [definition]
    if isinstance(definition, idl.Service):
        return [definition.request_message, definition.response_message, definition.event_message]
    return [definition.goal, definition.result, definition.feedback, definition.feedback_message,
            *messages_of(definition.send_goal_service), *messages_of(definition.get_result_service)]


class Package:
    """A package, of which `folder` has the IDL files and type descriptions that rosidl made of it."""

    def __init__(self, folder):
        self.folder = folder
        self.files = sorted(folder.glob("*/*.idl"))
        self.members = {}  # message: [(name, type)]
        self.header = {}  # message: the file that declares how to serialize it
        for file in self.files:
            relative = file.relative_to(folder)
            content = parse_idl_file(idl.IdlLocator(folder, relative)).content
            for definition in content.get_elements_of_type((idl.Message, idl.Service, idl.Action)):
                for message in messages_of(definition):
                    name = "/".join(message.structure.namespaced_type.namespaced_name())
                    self.members[name] = [(member.name, member.type) for member in message.structure.members]
                    self.header[name] = relative

    def generate(self, share):
        """Has rosidl write structures and type support for C++ beside the IDL files."""
        arguments = {
            "package_name": self.folder.name, "output_dir": str(self.folder), "target_dependencies": [],
            "idl_tuples": [f"{self.folder}:{file.relative_to(self.folder)}" for file in self.files],
            "type_description_tuples": [f"{file.relative_to(self.folder)}:{file.with_suffix('.json')}" for file in self.files],
            "ros_interface_files": [],
            "include_paths": [f"{one.name}:{one}" for root in (share, self.folder.parent) for one in root.iterdir()]}
        for generator, generate in (("rosidl_generator_c", generate_c), ("rosidl_generator_cpp", generate_cpp),
                                    ("rosidl_typesupport_fastrtps_cpp", generate_type_support)):
            templates = share / generator / "resource"
            file = self.folder / "arguments.json"
            file.write_text(json.dumps({**arguments, "template_dir": str(templates)}))
            generate(str(file))
            for template in templates.glob("*visibility_control*.in"):
                text = template.read_text().replace("@PROJECT_NAME@", self.folder.name)
                into = self.folder / "msg" / template.stem
                into.parent.mkdir(exist_ok=True)
                into.write_text(text.replace("@PROJECT_NAME_UPPER@", self.folder.name.upper()))


def literal(kind, value):
    """A value of a number or text in C++."""
    if isinstance(kind, idl.AbstractGenericString):
        wide = isinstance(kind, idl.AbstractWString)
        escaped = "".join(f"\\U{ord(one):08x}" if ord(one) > 0x7f or wide else one for one in value)
        return f'u"{escaped}"' if wide else f'"{escaped}"'
    if kind.typename == "boolean":
        return "true" if value else "false"
    if kind.typename in ("float", "double"):
        return f"{float(value).hex()}{'f' if kind.typename == 'float' else ''}"
    if kind.typename == "int64":
        return f"static_cast<std::int64_t>({value % 2**64}ULL)"
    return f"{value}ULL" if kind.typename == "uint64" else f"{value}"


def assignments(place, kind, value, members_of):
    """Statements that make the member of C++ called `place`, of type `kind`, have `value`."""
    if isinstance(kind, idl.AbstractNestedType):
        if not isinstance(kind, idl.Array):
            yield f"{place}.resize({len(value)});"
        for i, one in enumerate(value):
            yield from assignments(f"{place}[{i}]", kind.value_type, one, members_of)
    elif isinstance(kind, idl.NamespacedType):
        types = dict(members_of("/".join(kind.namespaced_name())))
        for name, one in value.items():
            yield from assignments(f"{place}.{name}", types[name], one, members_of)
    else:
        yield f"{place} = {literal(kind, value)};"


def program(package, values, members_of):
    """C++ that prints "TYPE CDR" of each of `values`: a message of the package, and what its members have."""
    yield HEADERS
    for file in package.files:
        stem = convert_camel_case_to_lower_case_underscore(file.stem)
        folder = f"{package.folder.name}/{file.parent.name}"
        yield f"#include <{folder}/{stem}.hpp>\n#include <{folder}/detail/dds_fastrtps/{stem}__type_support.cpp>"
    yield SERIALIZE
    for number, (name, value) in enumerate(values.items()):
        package_name, folder, cls = name.split("/")
        yield f"static void print{number}() {{\n  {package_name}::{folder}::{cls} message;"
        kind = idl.NamespacedType([package_name, folder], cls)
        yield from (f"  {line}" for line in assignments("message", kind, value, members_of))
        yield (f'  print("{name}", message, [](const auto& one, auto& cdr) {{ '
               f"{package_name}::{folder}::typesupport_fastrtps_cpp::cdr_serialize(one, cdr); }});\n}}")
    yield f"void print_{package.folder.name}() {{"
    yield from (f"  print{number}();" for number in range(len(values)))
    yield "}"


def serialized(packages, values, members_of, share):
    """{message: bytes in hexadecimal} of `values`, {message: {member: value}}, for messages of `packages`."""
    prefix = share.parent
    work = packages[0].folder.parent
    includes = [f"-I{work}", f"-I{prefix / 'include'}", *(f"-I{folder}" for folder in sorted((prefix / "include").iterdir()))]
    for package in packages:
        package.generate(share)
    compiler = ["g++", "-std=c++17", "-O0", "-w", *includes]

    def compiled(package):
        own = {name: value for name, value in values.items() if name.split("/")[0] == package.folder.name}
        source = package.folder / "print.cpp"
        source.write_text("\n".join(program(package, own, members_of)))
        subprocess.run([*compiler, "-c", source, "-o", source.with_suffix(".o")], check=True)
        return source.with_suffix(".o")

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        objects = list(pool.map(compiled, packages))
    main = work / "main.cpp"
    names = [f"print_{package.folder.name}" for package in packages]
    main.write_text("".join(f"void {name}();\n" for name in names) +
                    "int main() {" + "".join(f" {name}();" for name in names) + " }\n")
    # Of the packages that are used only how they are serialized is needed; what else type support names is not.
    libraries = [*(prefix / "lib").glob("*typesupport_fastrtps_cpp.so"), *(prefix / "lib").glob("libfastcdr.so*")]
    subprocess.run([*compiler, main, *objects, *libraries, f"-Wl,-rpath,{prefix / 'lib'}", "-Wl,--unresolved-symbols=ignore-all",
                    "-o", work / "print"], check=True)
    printed = subprocess.run([work / "print"], stdout=subprocess.PIPE, text=True, check=True).stdout
    return dict(line.split() for line in printed.splitlines())
