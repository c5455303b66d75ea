#!/usr/bin/env python3
"""Franca's own parser and validator, 0.13.1, judges the FIDL and FDEPL files that we write.

franca.py --fetch FOLDER        gets the jars of jars.txt from Maven Central into FOLDER (build/franca), and compiles
                                Validate.java; ./run setup --peers does that
franca.py FOLDER TEST_PROGRAM   lets TEST_PROGRAM (bridge_describe_fidl_test) write its files, and judges them

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
# Written from FIDL files alone, or with a deployment for D-Bus: they have not the ids that Franca wants, and are not judged.
WITH_IDS = (".fdepl", "everything", "names")
WITHOUT_IDS = ("DBus.fdepl",)


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
    """Exit status and output of Franca."""
    run = subprocess.run(["java", "--add-opens", "java.base/java.lang=ALL-UNNAMED", "-cp",
                          f"{folder}/classes:{folder}/jars/*", "Validate", specifications(), *files],
                         stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    return run.returncode, run.stdout


def main():
    if sys.argv[1] == "--fetch":
        return fetch(pathlib.Path(sys.argv[2]).resolve())
    folder = pathlib.Path(sys.argv[1]).resolve()
    if not (folder / "classes/Validate.class").is_file():
        missing("Franca")
    specifications()
    with tempfile.TemporaryDirectory() as out:
        subprocess.run([sys.argv[2], "--gtest_filter=WriteFidl.*"], check=True, stdout=subprocess.DEVNULL,
                       env={**os.environ, "TRESTLE_FIDL_OUT": out})
        files = sorted(str(file) for case in pathlib.Path(out).iterdir() if case.name.endswith(WITH_IDS)
                       and not case.name.endswith(WITHOUT_IDS) for file in case.iterdir())
        # That it can fail.
        bad = pathlib.Path(out) / "bad.fidl"
        bad.write_text("package a\ninterface I { attribute Nothing n }\n")
        status, told = validate(folder, [bad])
        if status == 0:
            print("Franca accepts what is wrong:", told, sep="\n")
            return 1
        status, told = validate(folder, files)
        accepted = sum(line.startswith("ok ") for line in told.splitlines())
        print(*(line for line in told.splitlines() if ": error: " in line), f"{accepted} of {len(files)} files accepted", sep="\n")
        return 0 if status == 0 and accepted == len(files) > 0 else 1


if __name__ == "__main__":
    sys.exit(main())
