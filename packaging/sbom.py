#!/usr/bin/env python3
"""sbom.py --build BUILD --version VERSION: what the program `trestle` of a build is made of, as SPDX 2.3 (JSON).

Nothing is listed by hand. The libraries that it loads are those in the program itself; what it has of others in its own code
is what the compiler read for its objects, as Ninja took note of it. Both are named by the packages that brought them to this
machine. The same build on the same machine gives the same bytes.
"""
import argparse
import datetime
import hashlib
import json
import os
import pathlib
import re
import subprocess

# Headers of these say what the system is, and leave nothing of their own in a program that loads the library itself.
TOOLCHAIN = re.compile(r"^(gcc|g\+\+|libgcc|libstdc\+\+|libc6-dev|libc-dev|linux-libc-dev|clang|libclang|libcrypt)")


def output(*command):
    return subprocess.run(command, stdout=subprocess.PIPE, check=True, text=True).stdout


def owners(files):
    """The packages that brought these files. Where /lib is a link to /usr/lib, dpkg may know either name."""
    names = {name for file in files for path in {file, os.path.realpath(file)} for name in (path, re.sub(r"^/usr/", "/", path))}
    found = set()
    names = sorted(names)
    for at in range(0, len(names), 500):
        done = subprocess.run(["dpkg-query", "--search", *names[at:at + 500]], stdout=subprocess.PIPE,
                              stderr=subprocess.DEVNULL, text=True)
        for line in done.stdout.splitlines():
            packages, _, _ = line.partition(": ")
            found.update(re.sub(r":\w+$", "", name) for name in packages.split(", "))
    return found


def loaded(program):
    """Files of the libraries that the program itself names; those that they load are theirs."""
    needed = re.findall(r"\(NEEDED\).*\[(.*)\]", output("readelf", "--dynamic", "--wide", program))
    paths = dict(re.findall(r"^\s*(\S+) => (/\S+)", output("ldd", program), re.MULTILINE))
    return [paths[name] for name in needed if name in paths]


def headers(build, program):
    """Files outside of the build and its sources that went into the program's objects."""
    inputs, commands = set(), output("ninja", "-C", build, "-t", "inputs", program).split()
    inputs.update(commands)
    found, used = set(), False
    for line in output("ninja", "-C", build, "-t", "deps").splitlines():
        if line and not line[0].isspace():
            used = line.partition(":")[0] in inputs
        elif used and line.strip().startswith("/"):
            found.add(line.strip())
    return found


def system():
    """The ID and the name of the distribution."""
    values = dict(re.findall(r'^(\w+)="?([^"\n]*)', pathlib.Path("/etc/os-release").read_text(), re.MULTILINE))
    return values.get("ID", "debian"), values.get("NAME", "Debian GNU/Linux")


def source_of(name):
    return output("dpkg-query", "--show", "--showformat=${source:Package}", name)


def package(name):
    distribution, supplier = system()
    version, source, arch, homepage = output(
        "dpkg-query", "--show", "--showformat=${Version}\t${source:Package}\t${Architecture}\t${Homepage}", name).split("\t")
    return {
        "SPDXID": "SPDXRef-Package-" + re.sub(r"[^A-Za-z0-9.-]", "-", name),
        "name": name,
        "versionInfo": version,
        "supplier": f"Organization: {supplier}",
        "downloadLocation": "NOASSERTION",
        "filesAnalyzed": False,
        "licenseConcluded": "NOASSERTION",
        "licenseDeclared": "NOASSERTION",
        "copyrightText": "NOASSERTION",
        "sourceInfo": "built from the source package " + source,
        **({"homepage": homepage} if homepage else {}),
        "externalRefs": [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl",
                          "referenceLocator": f"pkg:deb/{distribution}/{name}@{version}?arch={arch}".replace("+", "%2B")}],
    }


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--build", required=True)
    parser.add_argument("--version", required=True)
    arguments = parser.parse_args()
    build = pathlib.Path(arguments.build).resolve()
    program = build / "bridge/trestle"
    runtime = owners(loaded(str(program)))
    compiled = {name for name in owners(headers(str(build), "bridge/trestle")) if not TOOLCHAIN.match(name)}
    when = datetime.datetime.fromtimestamp(int(os.environ.get("SOURCE_DATE_EPOCH", "0")), datetime.timezone.utc)
    trestle = {
        "SPDXID": "SPDXRef-Package-trestle",
        "name": "trestle",
        "versionInfo": arguments.version,
        "supplier": "NOASSERTION",
        "downloadLocation": "NOASSERTION",
        "filesAnalyzed": False,
        "licenseConcluded": "Apache-2.0",
        "licenseDeclared": "Apache-2.0",
        "copyrightText": "NOASSERTION",
        "primaryPackagePurpose": "APPLICATION",
    }
    others = [package(name) for name in sorted(runtime | compiled)]

    loaded_sources = {source_of(name) for name in runtime}

    def related(one):
        # Libraries of headers alone end in our own code; headers of what is loaded only led to it.
        if one["name"] not in runtime and source_of(one["name"]) in loaded_sources:
            return {"spdxElementId": one["SPDXID"], "relationshipType": "BUILD_DEPENDENCY_OF",
                    "relatedSpdxElement": trestle["SPDXID"]}
        kind = "DYNAMIC_LINK" if one["name"] in runtime else "STATIC_LINK"
        return {"spdxElementId": trestle["SPDXID"], "relationshipType": kind, "relatedSpdxElement": one["SPDXID"]}
    document = {
        "spdxVersion": "SPDX-2.3",
        "dataLicense": "CC0-1.0",
        "SPDXID": "SPDXRef-DOCUMENT",
        "name": f"trestle-{arguments.version}",
        "documentNamespace": "",
        "creationInfo": {"created": when.strftime("%Y-%m-%dT%H:%M:%SZ"), "creators": ["Tool: trestle-packaging/sbom.py"]},
        "packages": [trestle, *others],
        "relationships": [{"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES",
                           "relatedSpdxElement": trestle["SPDXID"]}, *map(related, others)],
    }
    # Unique to what the document says, and the same when it says the same.
    digest = hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()
    document["documentNamespace"] = f"urn:trestle:spdx:{digest}"
    print(json.dumps(document, indent=2))


if __name__ == "__main__":
    main()
