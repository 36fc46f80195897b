"""Tests of the thread that answers only the newest request, and of Blender's frame rates."""

import threading

import numpy as np
import pytest
from without_blender import rates
from without_blender.latest import Latest

SECONDS = 10


@pytest.fixture
def held():
    """A thread whose answers wait until they are let go, and what it was asked."""
    asked, gate, begun = [], threading.Semaphore(0), threading.Semaphore(0)

    def answer(question):
        asked.append(question)
        begun.release()
        assert gate.acquire(timeout=SECONDS)
        if question == "broken":
            raise ValueError(question)
        return question * 10

    latest = Latest(answer)
    latest.asked, latest.gate, latest.begun = asked, gate, begun
    yield latest
    latest.close()
    gate.release(1000)
    assert latest.join(SECONDS)


def taken(latest):
    while latest.busy:
        if found := latest.take():
            return found
    return []


def test_of_many_questions_the_first_and_the_newest_are_asked(held):
    held.ask(0)
    assert held.begun.acquire(timeout=SECONDS)
    for question in range(1, 50):
        held.ask(question)
    held.gate.release(2)
    found = taken(held)
    while held.busy:
        found = taken(held) or found
    assert held.asked == [0, 49]
    assert found == [490]


def test_nothing_is_taken_twice(held):
    held.ask(1)
    held.gate.release()
    assert taken(held) == [10]
    assert held.take() == []
    assert not held.busy


def test_what_goes_wrong_is_an_answer_too_and_the_next_is_answered(held):
    held.gate.release(2)
    held.ask("broken")
    (fault,) = taken(held)
    assert isinstance(fault, ValueError)
    held.ask(2)
    assert taken(held) == [20]


def test_closed_it_ends_and_its_answer_is_dropped(held):
    held.ask(1)
    assert held.begun.acquire(timeout=SECONDS)
    held.ask(2)
    held.close()
    held.gate.release()
    assert held.join(SECONDS)
    assert (held.take(), held.asked) == ([], [1])


@pytest.mark.parametrize("rate", [1.0, 23.976, 24.0, 25.0, 29.97, 30.0, 59.94, 60.0, 120.0, 1000.0])
def test_a_scene_holds_every_rate(rate):
    whole, divisor = rates.parts(rate)
    assert isinstance(whole, int)
    held = rates.rate(whole, float(np.float32(divisor)))
    assert rates.same(held, rate)
    assert not rates.same(1.001 * held, rate)


def test_the_preset_of_blender_is_the_rate_of_television():
    assert rates.rate(30, float(np.float32(1.001))) == 30 / 1.001
    assert 30 / float(np.float32(1.001)) != 30 / 1.001
