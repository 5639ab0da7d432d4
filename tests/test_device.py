"""Where the package computes: where JAX has more than one place, and on one core."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from jaxmotor import recording

PAPER = Path(recording.__file__).parent / "bundled/paper.csv"

ELSEWHERE = """
import jax, jax.numpy as jnp, numpy as np
jax.config.update("jax_default_device", jax.devices()[1])
import jaxmotor as jm
from jaxmotor._precision import device, in_float64
from jaxmotor._programs import program
from jaxmotor.recording import bundled

@program
def twice(number):
    return {"twice": 2 * number}

@in_float64
def own():
    return jnp.ones(3), twice(jnp.ones(3))["twice"]

assert device() == jax.devices()[0]
assert all(one.devices() == {device()} and one.dtype == jnp.float64 for one in own())
given = jax.device_put(np.ones(3), jax.devices()[1])
assert jnp.ones(3).devices() == given.devices() == {jax.devices()[1]}, "the caller's own go where they went"
print(jm.identify(bundled("paper")).motor.gain)
"""


def printed(program: str, environment: dict[str, str]) -> str:
    return subprocess.run(
        [sys.executable, "-c", program], check=True, env=environment, stdout=subprocess.PIPE, text=True
    ).stdout


def test_computes_on_the_first_cpu_and_leaves_the_callers_arrays_where_they_go():
    flags = f"{os.environ['XLA_FLAGS']} --xla_force_host_platform_device_count=2"
    own = os.environ | {"XLA_FLAGS": flags, "JAXMOTOR_CACHE": ""}
    assert abs(float(printed(ELSEWHERE, own)) / 10.02091043 - 1) < 1e-8


def test_commands_leave_a_gpu_alone_unless_told():
    command = "import os; from jaxmotor.cli import main; main(['--version']); print(os.environ['JAX_PLATFORMS'])"
    own = {name: value for name, value in os.environ.items() if name != "JAX_PLATFORMS"}
    for told, expected in ((None, "cpu"), ("cuda,cpu", "cuda,cpu")):
        environment = own if told is None else own | {"JAX_PLATFORMS": told}
        assert printed(command, environment).splitlines()[-1] == expected


ONE_CORE = """
import os
os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
import jaxmotor as jm
print(jm.identify(jm.recording.bundled("paper")).motor.gain)
"""


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="this system does not say which cores a process has")
def test_one_core_is_enough():
    """XLA compiles otherwise for one core than for two."""
    assert abs(float(printed(ONE_CORE, os.environ | {"JAXMOTOR_CACHE": ""})) / 10.02091043 - 1) < 1e-8


HAS_GPU = pytest.mark.skipif(Path("/dev/nvidia0").exists(), reason="this machine has what is to be missing")


@pytest.mark.parametrize("platforms", [pytest.param("cuda", marks=HAS_GPU), "nonsense"])
def test_a_platform_that_is_not_there_is_said_to_be_missing(platforms: str):
    command = [sys.executable, "-m", "jaxmotor", "identify", str(PAPER)]
    own = os.environ | {"JAX_PLATFORMS": platforms}
    ran = subprocess.run(command, check=False, env=own, capture_output=True, text=True)
    assert ran.returncode == 1
    assert ran.stderr.splitlines()[-1] == (
        f"jaxmotor: JAX finds no device of JAX_PLATFORMS={platforms}; unset JAX_PLATFORMS, or set it to cpu"
    )


NOT_COMPILED = """
import jax
jax.config.update("jax_disable_jit", True)
import jaxmotor as jm
print(jm.identify(jm.recording.bundled("paper")).motor.gain, jax.config.jax_disable_jit)
"""


def test_simulations_are_compiled_where_a_caller_turned_that_off():
    gain, off = printed(NOT_COMPILED, dict(os.environ)).split()
    assert abs(float(gain) / 10.02091043 - 1) < 1e-8 and off == "True"
