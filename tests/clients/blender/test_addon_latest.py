"""Tests of the thread that answers only the newest question."""

import threading
import time

from without_blender.latest import Latest


def until(is_so):
    end = time.monotonic() + 20
    while not is_so():
        assert time.monotonic() < end
        time.sleep(0.005)


def test_the_newest_question_alone_is_answered_next():
    begun, released, asked = threading.Event(), threading.Event(), []

    def answer(question):
        asked.append(question)
        begun.set()
        released.wait(20)
        return 10 * question

    latest = Latest(answer)
    latest.ask(1)
    assert begun.wait(20)
    for question in (2, 3, 4):
        latest.ask(question)
    assert latest.busy
    released.set()
    until(lambda: asked == [1, 4])
    until(lambda: latest.take() == [40])
    until(lambda: not latest.busy)
    assert latest.take() == []


def test_an_error_is_a_result_and_the_next_question_is_answered():
    latest = Latest(lambda question: 1 / question)
    latest.ask(0)
    results = []
    until(lambda: results.extend(latest.take()) or results)
    assert isinstance(results[0], ZeroDivisionError)
    latest.ask(2)
    until(lambda: latest.take() == [0.5])
