"""Tests of readiness: unchanged output of the models, and no shutdown in progress."""

import dataclasses
import shutil
import time

import model_files
import pytest
import recorded
from asking import asker

from posefield.http.api.settings import Settings
from posefield.http.app import create_app
from posefield.http.readiness import Readiness
from posefield.registry.model_registry import (
    FixedRegistry,
    ModelRegistry,
    ReloadingRegistry,
    VersionLimits,
)


@pytest.fixture
def told():
    """Function that gives what /readyz answers of models."""

    def of(models):
        return asker(create_app(models, Settings()))("GET", "/readyz")

    return of


def refused(answer):
    assert answer.status_code == 503
    assert answer.headers["content-type"] == "application/problem+json"
    problem = answer.json()
    assert problem["type"] == "urn:posefield:problem:not-ready"
    return problem["detail"]


def changed(model, **values):
    """The model with a session of which something is otherwise."""
    return dataclasses.replace(model, session=dataclasses.replace(model.session, **values))


def test_a_model_that_answers_otherwise_than_it_did_is_not(told, loaded):
    models = dict(loaded.models)
    golden = models["walk"].session.golden
    models["walk"] = changed(models["walk"], golden=golden[:-1] + bytes([golden[-1] ^ 1]))
    assert refused(told(ModelRegistry(models))) == (
        f"not as when opened answers {models['walk'].identity}"
    )


def test_a_model_that_no_longer_answers_at_all_is_not(told, loaded):
    model = loaded.models["reach"]

    class Broken:
        def run(self, values, feed, level):
            raise RuntimeError("no answer")

    broken = changed(model, graph=Broken())
    assert model.identity in refused(told(ModelRegistry({"reach": broken})))


def test_no_model_is_not_ready(told):
    assert refused(told(ModelRegistry({}))) == "there is no model"


def test_a_service_that_ends_is_not(told, loaded):
    ending = Readiness(FixedRegistry(loaded))
    assert told(ending).status_code == 200
    ending.draining = True
    assert refused(told(ending)) == "the service is ending"
    assert asker(create_app(ending, Settings()))("GET", "/livez").status_code == 200


def test_models_are_asked_once_a_second_and_anew_when_they_change(loaded, monkeypatch):
    model = loaded.models["reach"]
    opened, asked = recorded.session(model.session)
    counted = dataclasses.replace(model, session=opened)
    clock = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: clock[0])
    fixed = FixedRegistry(ModelRegistry({"reach": counted}))
    ready = Readiness(fixed)
    for moment, times in ((100.0, 1), (100.9, 1), (101.1, 2)):
        clock[0] = moment
        ready.document(lambda name: True)
        # Of poses, and of the duration.
        assert len(asked) == 2 * times
    fixed.registry = ModelRegistry({"other": counted})
    ready.document(lambda name: True)
    assert len(asked) == 6


def test_a_file_that_is_meant_to_do_harm_is_told_and_the_others_are_taken(
    told, models, tmp_path, caplog
):
    """In /readyz, the metric and the log."""
    said = "takes more than 512 MB of memory to open"
    shutil.copy(models / "reach.onnx", tmp_path)
    shelf = ReloadingRegistry([tmp_path], VersionLimits())
    (tmp_path / "bad.onnx").write_bytes(model_files.large((models / "reach.onnx").read_bytes()))
    shutil.copy(models / "walk.onnx", tmp_path)
    shelf.scan()
    shelf.scan()
    ready = Readiness(shelf)
    answer = told(ready)
    assert answer.status_code == 200
    names = [identity.partition("@")[0] for identity in answer.json()["models"]]
    assert sorted(names) == ["reach", "walk"]
    expected = [{"model": "bad", "version": "", "detail": said}]
    assert answer.json()["reload"]["faults"] == expected
    assert f"bad.onnx: {said}" in caplog.text
    page = asker(create_app(ready, Settings()))("GET", "/metrics").text
    assert 'posefield_reloads{what="faults"} 1.0' in page
    assert 'posefield_reloads{what="failed"} 1.0' in page
