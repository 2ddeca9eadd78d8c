"""How many programs a wake takes, and how long they are: what a first answer waits for is the compiler.

Counts, not seconds, so that no busy machine upsets them. A fusion costs about 50 ms to compile, whatever it does.
"""

import cProfile
import re

import equinox as eqx
import jax
import pytest
from wakes import COARSE

from rotorjax.ground import plane
from rotorjax.wake import sensitivity
from rotorjax.wake.equilibrium import evaluate
from rotorjax.wake.model import free_wake
from rotorjax.wake.settings import wake_settings
from rotorjax.wake.solution import solve
from rotorjax.wake.start import prescribed

COMPILED = "/jax/core/compile/backend_compile_duration"
PROGRAMS = []


@pytest.fixture
def programs():
    """Names of the programs made, also of those that the cache on disk spares compiling."""

    def hear(event, duration, **about):
        if event == COMPILED:
            PROGRAMS.append(about.get("fun_name", event))

    jax.clear_caches()
    PROGRAMS.clear()
    jax.monitoring.register_event_duration_secs_listener(hear)
    yield PROGRAMS
    jax.monitoring.unregister_event_duration_listener(hear)


def test_a_wake_takes_few_programs(uh60, coarse, programs):
    """One that evaluates, one that multiplies, one that reads off, and what lays out the start."""
    free, low, high = (free_wake(*uh60, g, coarse) for g in (None, plane(1.0), plane(1.3)))
    programs.clear()
    hover = solve(free)
    assert hover.converged
    assert len(programs) <= 15, programs
    programs.clear()
    assert solve(low, hover).converged
    assert len(programs) <= 8, programs
    programs.clear()
    assert solve(high, hover).converged
    assert not programs


@pytest.mark.calls_host
def test_a_search_under_jit_takes_the_programs_of_one_outside(uh60, coarse, programs):
    """jax calls the host with other settings and arrays than its user has, for which all would be traced anew."""
    found = solve(free_wake(*uh60, plane(1.0), coarse))
    programs.clear()
    thrust = jax.jit(lambda height: sensitivity.solve(free_wake(*uh60, plane(height), coarse), start=found).CT)
    assert float(thrust(1.0)) == pytest.approx(found.CT, rel=1e-9)  # it begins where it ends
    assert "jit(<lambda>)" in programs
    assert not {"jit(_linearised)", "jit(_product)"} & set(programs), programs


def misses(call):
    """How many calls of jitted programs jax could not send off at once, but looked at in Python and traced anew."""
    profile = cProfile.Profile()
    profile.runcall(call)
    return sum(row.callcount for row in profile.getstats() if getattr(row.code, "co_name", "") == "cache_miss")


def test_a_wake_solved_again_is_not_traced_again(uh60, coarse):
    """As jax does with every call of a program that holds a primitive of hijax (kernel_rule.py)."""
    assert misses(lambda: jax.jit(lambda x: x + 1)(1.0)) > 0
    hover = free_wake(*uh60, None, coarse)
    assert solve(hover).converged
    assert misses(lambda: solve(hover)) == 0


@pytest.mark.parametrize(("ground", "most"), [(None, 105), (plane(1.0), 140)], ids=["free", "level"])
def test_an_evaluation_is_a_short_program(uh60, ground, most):
    model = free_wake(*uh60, ground, wake_settings(**COARSE))
    arrays, rest = eqx.partition(model, eqx.is_array)
    program = jax.jit(lambda arrays, x: evaluate(eqx.combine(arrays, rest), x))
    text = program.lower(arrays, prescribed(model)).compile().as_text()
    assert len(re.findall(r" fusion\(", text)) <= most
