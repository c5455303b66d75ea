#!/usr/bin/env python3
"""Franca's own parser and validator, 0.13.1, judges the FIDL and FDEPL files that we write.

franca.py --fetch FOLDER        gets the jars of jars.txt from Maven Central into FOLDER (build/franca), and compiles
                                Validate.java; ./run setup --peers does that
franca.py FOLDER FIDL_TEST TRIPS_TEST
                                lets these (bridge_describe_fidl_test, bridge_describe_targets_test) write their files,
                                and judges them: those of FIDL with its deployments, and those of ARXML, vsomeip JSON,
                                ROS types and all real files that can be read

CommonAPI's deployment specifications are taken from the real files beside the project (../shared/corpora, or
TRESTLE_CORPORA); without them it is skipped (77). So it is without Java or the jars, but fails then with
TRESTLE_REQUIRE_PEERS=1.
"""
import os
import pathlib
import subprocess
import sys
import tempfile
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
# Of FIDL_TEST, with the ids that Franca wants; real files are among those of TRIPS_TEST.
WITH_IDS = ("everything", "names", "overloads", "inherited")
# What Franca refuses, so that it is known to judge.
WRONG = {
    "type": "package a\ninterface I { attribute Nothing n }\n",
    "inout": "package a\ninterface I { method m { in { UInt8 x } out { UInt8 x } } }\n",
    "union": "package a\ntypeCollection T { union U { UInt8 x UInt8 y } }\n",
    "cycle": "package a\ntypeCollection T { const UInt8 a = b const UInt8 b = a }\n",
}


def missing(what):
    required = set(os.environ.get("TRESTLE_REQUIRE_PEERS", "0").split(",")) & {"1", "franca"}
    print(f"{'missing' if required else 'skipped'}: {what}; ./run setup --peers installs it")
    sys.exit(1 if required else 77)


def pom():
    jars = "".join(
        "<dependency><groupId>{}</groupId><artifactId>{}</artifactId><version>{}</version><exclusions><exclusion>"
        "<groupId>*</groupId><artifactId>*</artifactId></exclusion></exclusions></dependency>\n".format(*line.split(":"))
        for line in (HERE / "jars.txt").read_text().split())
    return ('<project xmlns="http://maven.apache.org/POM/4.0.0"><modelVersion>4.0.0</modelVersion><groupId>trestle</groupId>'
            f"<artifactId>franca</artifactId><version>1</version><dependencies>\n{jars}</dependencies></project>\n")


def without_signatures(jar, folder):
    """Signed jars are refused beside unsigned ones that share their packages."""
    with zipfile.ZipFile(jar) as old, zipfile.ZipFile(folder / jar.name, "w") as new:
        for entry in old.infolist():
            if not (entry.filename.startswith("META-INF/") and entry.filename.endswith((".SF", ".RSA", ".DSA"))):
                new.writestr(entry, old.read(entry))


def fetch(folder):
    (folder / "jars").mkdir(parents=True, exist_ok=True)
    (folder / "pom.xml").write_text(pom())
    with tempfile.TemporaryDirectory() as signed:
        subprocess.run(["mvn", "-q", "-B", "-f", folder / "pom.xml", "dependency:copy-dependencies",
                        f"-DoutputDirectory={signed}"], check=True)
        for jar in sorted(pathlib.Path(signed).glob("*.jar")):
            without_signatures(jar, folder / "jars")
    subprocess.run(["javac", "-cp", f"{folder}/jars/*", "-d", folder / "classes", HERE / "Validate.java"], check=True)


def specifications():
    for corpora in (os.environ.get("TRESTLE_CORPORA"), HERE / "../../../../../shared/corpora",
                    HERE / "../../../../../../shared/corpora"):
        if corpora and (pathlib.Path(corpora) / "deployment_specs").is_dir():
            return pathlib.Path(corpora).resolve() / "deployment_specs"
    print("skipped: the folder with CommonAPI's deployment specifications is not there")  # nobody can install it
    sys.exit(77)


def validate(folder, files):
    """What Franca says. It is started once: that takes longer than many files."""
    return subprocess.run(["java", "--add-opens", "java.base/java.lang=ALL-UNNAMED", "-cp",
                           f"{folder}/classes:{folder}/jars/*", "Validate", specifications(), *files],
                          stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True).stdout


def main():
    if sys.argv[1] == "--fetch":
        return fetch(pathlib.Path(sys.argv[2]).resolve())
    folder = pathlib.Path(sys.argv[1]).resolve()
    if not (folder / "classes/Validate.class").is_file():
        missing("Franca")
    specifications()
    with tempfile.TemporaryDirectory() as out:
        for program, tests in ((sys.argv[2], "WriteFidl.*"), (sys.argv[3], "FidlOfOthers.*")):
            folder_of_program = pathlib.Path(out, tests.split(".")[0])
            folder_of_program.mkdir()
            subprocess.run([program, f"--gtest_filter={tests}"], check=True, stdout=subprocess.DEVNULL,
                           env={**os.environ, "TRESTLE_FIDL_OUT": str(folder_of_program)})
        good = sorted(str(file) for case in pathlib.Path(out).glob("*/*") for file in case.iterdir()
                      if case.parent.name != "WriteFidl" or case.name in WITH_IDS)
        wrong = []
        for name, text in WRONG.items():
            wrong.append(str(pathlib.Path(out, f"{name}.fidl")))
            pathlib.Path(wrong[-1]).write_text(text)
        told = validate(folder, wrong + good).splitlines()
        unseen = [file for file in wrong if f"failed {file}" not in told]
        accepted = [file for file in good if f"ok {file}" in told]
        print(*(line for line in told if ": error: " in line and not line.startswith(tuple(wrong))),
              *(f"Franca accepts what is wrong: {file}" for file in unseen),
              f"{len(accepted)} of {len(good)} files accepted", sep="\n")
        return 0 if not unseen and len(accepted) == len(good) > 0 else 1


if __name__ == "__main__":
    sys.exit(main())
