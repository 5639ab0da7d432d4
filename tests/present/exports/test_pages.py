"""The code on the pages about control and exports runs."""

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from cases import made

import jaxmotor as jm
from jaxmotor.cli import main
from jaxmotor.estimate import model_to_json

DOCS = Path(__file__).parents[3] / "docs"


def blocks(page, language):
    return re.findall(f"```{language}\n(.*?)```", (DOCS / page).read_text(), re.DOTALL)


def block(page, language):
    return blocks(page, language)[0]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("JAXMOTOR_CACHE", "")
    (tmp_path / "results").mkdir()
    model = made(("coulomb_friction", {"volts_V": 0.31}), response=True)
    (tmp_path / "results" / "motor.json").write_text(json.dumps(model_to_json(model)))
    return tmp_path


def test_the_control_page(folder):
    scope = {}
    exec(block("control.md", "python"), scope)
    assert scope["predicted"].overshoot_percent.high < 5 and abs(scope["predicted"].steady_error.value) < 0.05
    assert scope["design"].bandwidth_Hz == pytest.approx(8.0, rel=1e-3)


def test_the_export_page_in_python(folder):
    pytest.importorskip("control", reason="python-control is not installed; pip install control")
    scope = {"jm": jm}
    exec(block("export.md", "python"), scope)
    assert scope["motor"].response is not None


@pytest.mark.skipif(not shutil.which("cc"), reason="needs a C compiler; apt install build-essential")
def test_the_export_page_in_c(folder):
    rig = ["--counts-per-rev", "617.4", "--supply", "7.4", "--delay", "40e-6"]
    assert main(["export", "results/motor.json", "--to", "c", *rig, "-o", "motor.h"]) == 0
    include = '#include "motor.h"\n'
    rest = "int32_t count(void);\nvoid set_duty(int16_t duty);\nstatic int32_t before;\n"
    (folder / "page.c").write_text(block("export.md", "c").replace(include, include + rest))
    command = ["cc", "-std=gnu11", "-Wall", "-Wextra", "-Werror", "-c", "page.c", "-o", "page.o"]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_the_export_page_in_json(folder):
    content = model_to_json(made()) | json.loads("{" + ",".join(blocks("export.md", "json")) + "}")
    (folder / "results" / "motor.json").write_text(json.dumps(content))
    model = jm.read_model(folder / "results" / "motor.json")
    assert float(model.effects[0].volts_V) == 0.31
    assert model.joint is not None and model.joint.names[2] == "coulomb_friction.volts_V"


@pytest.mark.skipif(not shutil.which("ngspice"), reason="ngspice is not installed; apt install ngspice")
def test_the_export_page_in_spice(folder):
    assert main(["export", "results/motor.json", "--to", "spice", "--resistance", "4.5", "-o", "motor.lib"]) == 0
    text = block("export.md", "text") + ".print tran v(speed)\n.end\n"
    (folder / "page.cir").write_text("title\n" + text)
    done = subprocess.run(["ngspice", "-b", "page.cir"], check=False, capture_output=True, text=True)
    last = [line.split() for line in done.stdout.splitlines() if re.match(r"\d+\t", line)][-1]
    assert float(last[2]) == pytest.approx(10.6 * (5 - 0.31), rel=1e-3), done.stdout[-2000:] + done.stderr
