"""How large the core is on a Cortex-M3, and how much memory it needs: the tables of docs/embedding.md.

    measure.py [--update [WHY]]  compares what `./run embedded` has built and run with the block of docs/embedding.md
                                 between its two markers, or writes that

Sizes may grow by 2 % before they have to be written anew, with the reason, which is kept below the tables; no fewer tests
than written may have passed. The goals of text and RAM have to be kept with any compiler; all other figures are not
compared when the page has those of another one.
"""
import argparse
import collections
import pathlib
import re
import subprocess
import sys

SOURCE = pathlib.Path(__file__).resolve().parent.parent.parent
BUILD = SOURCE / "build" / "cortex-m3"
PAGE = SOURCE / "docs" / "embedding.md"
BEGIN = "<!-- embedded table: begin -->\n"
END = "<!-- embedded table: end -->\n"
MODULES = ["someip_wire", "someip", "sd_wire", "sd", "someip_e2e", "device", "c"]
INLINE = "inline functions and templates"
TEXT_GOAL = 24 * 1024
RAM_GOAL = 8 * 1024
GROWTH = 1.02
NOTE = "- grown: "
# Programs that are linked with a device.
PROGRAMS = {
    "examples/bare_device": "test/embedded/bare_device",
    "test/embedded/c_device.c": "test/embedded/core_c",
    "examples/cortex_m": "examples/cortex_m/cortex_m_device",
    "examples/cortex_m, Enhanced Testability Service": "examples/cortex_m/cortex_m_ets_device",
}
# Of library functions the compiler tells nothing. The deepest of them is a 64 bit division, __aeabi_uldivmod.
LIBRARY_STACK = 64

# A section in a linker's map: name, size and origin.
SECTION = re.compile(r"^ \.((?:text|rodata|ARM\.ex)\S*)\s+0x[0-9a-f]+\s+0x([0-9a-f]+) (\S+)$", re.MULTILINE)
# Functions in an object of the program that are its own; all others there are templates and inline functions of headers.
PROGRAM = re.compile(r"\.(main$|startup\.main$|_ZN12_GLOBAL__N_1|_ZL)")
PASSED = re.compile(r"\[  PASSED  \] (\d+) tests?\.")

# The calls of an application whose stack is told.
ENTRIES = {
    "ServiceDiscovery::on_datagram": "_ZN7trestle2sd16ServiceDiscovery11on_datagram",
    "ServiceDiscovery::on_time": "_ZN7trestle2sd16ServiceDiscovery7on_timeE",
    "ServiceDiscovery::poll_transmit": "_ZN7trestle2sd16ServiceDiscovery13poll_transmit",
    "ServiceDiscovery::poll_event": "_ZN7trestle2sd16ServiceDiscovery10poll_event",
    "ServiceDiscovery::offer": "_ZN7trestle2sd16ServiceDiscovery5offerE",
    "ServiceDiscovery::require": "_ZN7trestle2sd16ServiceDiscovery7requireE",
    "ServiceDiscovery::subscribe": "_ZN7trestle2sd16ServiceDiscovery9subscribeE",
    "ServiceDiscovery::link_down": "_ZN7trestle2sd16ServiceDiscovery9link_downE",
    "ServiceDiscovery::shutdown": "_ZN7trestle2sd16ServiceDiscovery8shutdownE",
    "TpReassembler::on_segment": "_ZN7trestle6someip13TpReassembler10on_segment",
    "TpSegmenter::next": "_ZN7trestle6someip11TpSegmenter4nextE",
    "MessageCursor::next": "_ZN7trestle6someip13MessageCursor4nextE",
    "CallTable::on_answer": "_ZN7trestle6someip9CallTable9on_answer",
    "Device::on_datagram": "_ZN7trestle6device6Device11on_datagram",
    "Device::on_time": "_ZN7trestle6device6Device7on_timeE",
    "Device::poll_transmit": "_ZN7trestle6device6Device13poll_transmit",
    "Device::poll_happening": "_ZN7trestle6device6Device14poll_happening",
    "Device::offer": "_ZN7trestle6device6Device5offerE",
    "Device::require": "_ZN7trestle6device6Device7requireE",
    "Device::notify": "_ZN7trestle6device6Device6notifyE",
    "Device::set_field": "_ZN7trestle6device6Device9set_fieldE",
    "Device::respond": "_ZN7trestle6device6Device7respondE",
    "Device::call": "_ZN7trestle6device6Device4callE",
    "Device::link_down": "_ZN7trestle6device6Device9link_downE",
    "Device::shutdown": "_ZN7trestle6device6Device8shutdownE",
    "trestle_init": "trestle_init",
    "trestle_on_datagram": "trestle_on_datagram",
    "trestle_on_time": "trestle_on_time",
    "trestle_poll_transmit": "trestle_poll_transmit",
    "trestle_poll_happening": "trestle_poll_happening",
    "trestle_notify": "trestle_notify",
    "trestle_call": "trestle_call",
}


def output(*command):
    return subprocess.run(command, check=True, text=True, stdout=subprocess.PIPE).stdout


def modules():
    """text, data and bss of everything in each library."""
    for name in MODULES:
        folder = "someip" if name.startswith("someip") else "sd"
        total = output("arm-none-eabi-size", "-t", BUILD / folder / f"libtrestle_{name}.a").splitlines()[-1].split()
        yield name, [int(number) for number in total[:3]]


def linked(program):
    """Where the bytes of the core in flash memory of a linked program come from: each library, libgcc, and what of headers
    the compiler has put into its own objects. And the sum."""
    found = collections.Counter()
    text = pathlib.Path(f"{program}.map").read_text(encoding="utf-8")
    text = text[text.index("Linker script and memory map"):]
    for section, size, origin in SECTION.findall(text):
        library = re.search(r"lib(?:trestle_|closed_)?(\w+)\.a\(", origin)
        inline = section.startswith("text._Z") and not PROGRAM.search(section)
        found[library[1] if library else INLINE if inline else pathlib.Path(origin).name] += int(size, 16)
    core = {name: size for name, size in found.items() if name in MODULES + [INLINE, "gcc"]}
    return core, sum(core.values())


def call_graph(files):
    """Frames in bytes and callees, by the name of the function; also which frames the compiler cannot bound."""
    frames, callees, unbounded = {}, collections.defaultdict(set), set()
    for file in files:
        text = file.read_text(encoding="utf-8")
        for title, label in re.findall(r'node: \{ title: "([^"]*)" label: "([^"]*)"', text):
            size = re.search(r"(\d+) bytes \((\w+)", label)
            if size:
                name = title.rsplit(":", 1)[-1]
                frames[name] = max(frames.get(name, 0), int(size[1]))
                if size[2] != "static":
                    unbounded.add(name)
        for caller, callee in re.findall(r'edge: \{ sourcename: "([^"]*)" targetname: "([^"]*)"', text):
            callees[caller.rsplit(":", 1)[-1]].add(callee.rsplit(":", 1)[-1])
    return frames, callees, unbounded


def deepest(name, frames, callees, path=()):
    """(bytes, path) of the deepest chain of calls from here on."""
    if name in path:
        sys.exit(f"error: {name} calls itself: its stack has no bound")
    if name == "__indirect_call":
        sys.exit(f"error: {path[-1]} calls what the compiler does not know: its stack has no bound")
    if name not in frames:
        return LIBRARY_STACK, (name,)
    below = max((deepest(callee, frames, callees, path + (name,)) for callee in callees[name]), default=(0, ()))
    return frames[name] + below[0], (name, *below[1])


def stack():
    """For each entry: bytes, and the functions on the way that need most of it."""
    graphs = sorted(file for name in MODULES for file in BUILD.glob(f"*/CMakeFiles/trestle_{name}.dir/**/*.ci"))
    frames, callees, unbounded = call_graph(graphs)
    if unbounded:
        sys.exit(f"error: the stack of {', '.join(sorted(unbounded))} has no bound")
    for label, prefix in ENTRIES.items():
        matching = [name for name in frames if name.startswith(prefix) and "isra" not in name and "part" not in name]
        if not matching:
            sys.exit(f"error: no function {label} in what was built")
        size, path = max(deepest(name, frames, callees) for name in matching)
        largest = max((name for name in path if name in frames), key=frames.get)
        readable = output("arm-none-eabi-c++filt", largest).strip()
        readable = re.sub(r"trestle::(someip|sd|device)::|\(anonymous namespace\)::|\(.*", "", readable)
        yield label, size, readable, frames[largest]


def ram(program):
    """The objects of typical.cpp that hold its configuration, by name."""
    table = output("arm-none-eabi-nm", "-S", "--radix=d", program)
    return {name: int(size) for size, name in re.findall(r"^\d+ (\d+) \w ram_(\w+)$", table, re.MULTILINE)}


def device_ram():
    """The parts of a StaticDevice<Limits{}>, and all of it, as the target trestle_ram prints them."""
    printed = output("cmake", "--build", BUILD, "--target", "trestle_ram")
    if "StaticDevice<Limits{}>" not in printed:
        sys.exit(f"error: {BUILD} has other limits: set TRESTLE_RAM_LIMITS to nothing")
    return re.findall(r"^  ([a-z][a-z ]*?) +(\d+)$", printed, re.MULTILINE)


def for_each_slot(page):
    """What the page's table of limits says wrongly, of those that Limits{} has some of."""
    parts = {name.replace(" ", "_"): int(size) for name, size in device_ram()}
    described = (SOURCE / "sd" / "core" / "device" / "description.hpp").read_text(encoding="utf-8")
    for name, count in re.findall(r"std::uint\d+_t (\w+) = ([1-9]\d*);", described):
        row = re.search(rf"^\| `{name}`[^|]*\| (\d+) \|", page, re.MULTILINE)
        if row and int(row[1]) * int(count) != parts[name]:
            yield f"{name}: {parts[name]} bytes for {count}, the page says {row[1]} for each"


def tests(target):
    """How many tests passed: of each program that ran."""
    log = SOURCE / "build" / target / "Testing" / "Temporary" / "LastTest.log"
    return sum(int(passed) for passed in PASSED.findall(log.read_text(encoding="utf-8", errors="replace")))


def block():
    """The block of the page, and what is wrong with its figures."""
    faults = []
    version = output("arm-none-eabi-g++", "--version").splitlines()[0]
    lines = [f"Compiler: `{version}`, `-Os`.", ""]
    lines += ["| library, all of it | text | data | bss |", "| --- | ---: | ---: | ---: |"]
    lines += [f"| `{name}` | {text} | {data} | {bss} |" for name, (text, data, bss) in modules()]

    program = BUILD / "test" / "embedded" / "core_typical"
    full, all_of_it = linked(program)
    core, total = linked(BUILD / "test" / "embedded" / "core_closed")
    lines += ["", "| linked into a device with header codec, SD server, SD client and TP | text without guards | with guards |",
              "| --- | ---: | ---: |"]
    lines += [f"| `{'libgcc' if name == 'gcc' else name}` | {core.get(name, 0)} | {full.get(name, 0)} |"
              for name in sorted(core.keys() | full.keys())]
    if total > TEXT_GOAL:
        faults.append(f"{total} bytes of text without guards are more than the goal of {TEXT_GOAL}")
    missed = f"{total - TEXT_GOAL} more than" if total > TEXT_GOAL else "within"
    difference = f"{all_of_it - TEXT_GOAL} more than that" if all_of_it > TEXT_GOAL else "within it, too"
    lines += [f"| together | {total} | {all_of_it} |", "",
              f"Without guards that is {missed} the goal of {TEXT_GOAL}; with them it is {difference}."]

    lines += ["", "| whole program, linked with `Device` | text | data | bss |", "| --- | ---: | ---: | ---: |"]
    for label, path in PROGRAMS.items():
        sizes = output("arm-none-eabi-size", BUILD / path).splitlines()[-1].split()[:3]
        lines.append(f"| `{label}` | {' | '.join(sizes)} |")

    memory = ram(program)
    buffer = memory.pop("tp_buffer")
    lines += ["", "| RAM of the stated configuration | bytes |", "| --- | ---: |"]
    lines += [f"| `sd::Storage` | {memory['sd_storage']} |", f"| `sd::ServiceDiscovery` | {memory['sd']} |",
              f"| `TpReassembler`, a slot, its map | {memory['tp'] + memory['tp_slots'] + memory['tp_map']} |",
              f"| besides the TP buffer | {sum(memory.values())} |", f"| TP buffer | {buffer} |"]
    if sum(memory.values()) > RAM_GOAL:
        faults.append(f"{sum(memory.values())} bytes of RAM are more than the goal of {RAM_GOAL}")

    lines += ["", "| RAM of `StaticDevice<Limits{}>` | bytes |", "| --- | ---: |"]
    lines += [f"| {name} | {size} |" for name, size in device_ram() if int(size) > 0]

    lines += ["", "| deepest stack of a call | bytes | largest frame on the way |", "| --- | ---: | --- |"]
    lines += [f"| `{label}` | {size} | `{largest}`, {frame} |" for label, size, largest, frame in stack()]

    passed = {target: tests(target) for target in ("cortex-m3", "powerpc")}
    lines += ["", "| the core's tests | passed |", "| --- | ---: |"]
    lines += [f"| tests on {target} | {number} |" for target, number in passed.items()]
    if len(set(passed.values())) != 1 or not all(passed.values()):
        faults.append(f"the targets passed different tests, or none: {passed}")
    return "\n".join(lines) + "\n", faults


def figures(text):
    """The first number of each row, by what it is called in which table."""
    found, table = {}, ""
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if not line.startswith("|") or cells[1].startswith("---"):
            continue
        if cells[1].isdigit():
            found[table, cells[0]] = [int(cell) for cell in cells[1:] if cell.isdigit()]
        else:
            table = cells[0]
    return found


def explained(text):
    """The figures of each row up to which the page says why it grew, by its name and how many they are; a row that
    never grew by more than 2 % at once is not there."""
    found = {}
    for line in text.splitlines():
        if line.startswith(NOTE):
            name, _, rest = line.removeprefix(NOTE).partition(": [")
            values = [int(value) for value in rest.partition("]")[0].split(",")]
            found[name, len(values)] = values
    return found


def compare(old, new):
    """What of `new` is not as the page tells."""
    before, after = figures(old), figures(new)
    for key in sorted(before.keys() | after.keys()):
        if key not in before or key not in after:
            yield f"{key[1]}: {'not on the page' if key not in before else 'only on the page'}"
        elif key[1].startswith("tests on"):
            if after[key] < before[key]:
                yield f"{key[1]}: {after[key][0]} passed, the page says {before[key][0]}"
    yield from growth(old, after)


def growth(old, after):
    """What has grown by more than 2 %, of the figures that both have, since the page last said why: many small steps
    are a large one."""
    before, reasons = figures(old), explained(old)
    for key in before.keys() & after.keys():
        base = [min(pair) for pair in zip(before[key], reasons.get((key[1], len(before[key])), before[key]))]
        if not key[1].startswith("tests on") and any(b > a * GROWTH for a, b in zip(base, after[key])):
            yield f"{key[1]}: {after[key]}, more than 2 % above {base} of the page"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--update", nargs="?", const="", metavar="WHY",
                        help="write docs/embedding.md instead of comparing with it; WHY something grew by more than 2 %%")
    why = parser.parse_args().update
    new, faults = block()
    print(new)
    page = PAGE.read_text(encoding="utf-8")
    faults += for_each_slot(page)
    head, begin, rest = page.partition(BEGIN)
    old, end, tail = rest.partition(END)
    if not begin or not end:
        sys.exit(f"error: {PAGE} lacks the markers\n{BEGIN}{END}")
    same_compiler = old.splitlines()[:1] == new.splitlines()[:1]
    if why is not None:
        grown = sorted(growth(old, figures(new))) if same_compiler else []
        if grown and not why:
            sys.exit("\n".join(["error: --update WHY: the page is to tell why these grew:", *grown]))
        notes = [line for line in old.splitlines() if line.startswith(NOTE)]
        notes += [f"{NOTE}{one.removesuffix(' of the page')}: {why}" for one in grown]
        new += "\n".join(["", "What grew by more than 2 %, and why:", "", *notes, ""]) if notes else ""
        PAGE.write_text(head + begin + new + end + tail, encoding="utf-8")
    elif same_compiler:
        faults += compare(old, new)
    else:
        print(f"Not compared: the page is of another compiler: {old.splitlines()[:1]}")
    for fault in faults:
        print(f"error: {fault}", file=sys.stderr)
    if faults and why is None:
        print("If that is meant: ./run embedded --update WHY writes the figures into docs/embedding.md", file=sys.stderr)
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
