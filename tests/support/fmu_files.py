"""FMUs exported once per session, and the C program that opens them."""

import io
import shutil
import subprocess
import zipfile
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

from mrdamper.exporters.fmu import FMUExporter
from mrdamper.exporters.toolchain import here
from support.dampers import all_dampers, joint_damper, modified_damper

COMPILERS = [name for name in ("gcc", "clang") if shutil.which(name)]
STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror")
DAMPERS = all_dampers()
FEW = {"bouc-wen": DAMPERS["bouc-wen"], "joint": joint_damper(), "modified": modified_damper()}
DRIVER = Path(__file__).parents[1] / "export" / "fmu_driver.c"


@cache
def fmu_bytes(name, fmi, compiled=True):
    """An FMU of a damper, with a binary for this machine."""
    platform = here()
    platforms = (platform.name,) if compiled and platform else ()
    written = FMUExporter(fmi, platforms).export(DAMPERS[name], "damper")
    return written.files["damper.fmu"]


def unpacked(content):
    """Files of an FMU by path."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def sources(content, folder):
    """The C sources of an FMU, written to a folder; the names of those to compile."""
    for path, text in unpacked(content).items():
        if path.startswith("sources/"):
            (folder / path.removeprefix("sources/")).write_bytes(text)
    return sorted(p.name for p in folder.glob("*.c"))


def library(content, folder, compiler, *flags):
    """The sources of an FMU as a shared library."""
    files = sources(content, folder)
    command = [compiler, *STRICT, *flags, "-fPIC", "-shared", *files, "-lm", "-o", "damper.so"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder / "damper.so"


def driver(folder, *compiler, name="driver"):
    """The program that opens an FMU's binary; it needs dlopen, so it is not held to STRICT."""
    program = folder / name
    libraries = () if name.endswith(".exe") else ("-ldl",)
    command = [*compiler, "-std=gnu99", "-Wall", "-Wextra", "-Werror", str(DRIVER), *libraries, "-o", str(program)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return program


def description(content):
    """Token, and value references by name, of an FMU."""
    root = ElementTree.fromstring(unpacked(content)["modelDescription.xml"])
    token = root.get("guid") or root.get("instantiationToken")
    return token, {v.get("name"): v.get("valueReference") for v in root.find("ModelVariables")}


def drive(program, path, fmi, content, step, way, drive, rows, before=()):
    """Output of the driver; `before` precedes the command."""
    token, references = description(content)
    names = ("displacement", "velocity", "current", "force", "drive")
    command = [*before, program, path, str(fmi), token, repr(step), way, str(drive), *(references[n] for n in names)]
    text = "".join(f"{','.join(map(repr, row))}\n" for row in rows)
    done = subprocess.run(command, input=text, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout.split()
