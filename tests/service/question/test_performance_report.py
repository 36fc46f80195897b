"""Tests of the report of a performance: its document has what the contract promises."""

import jsonschema

from posefield.http.api import contract
from posefield.question.performance_report import PerformanceReport, SegmentReport
from posefield.question.results import FeetResult

CHECK = jsonschema.Draft202012Validator(contract.schema("PerformanceReport"))


def reported(feet):
    """Document of a report of one walk."""
    identity = "walk@0123456789abcdef"
    walk = SegmentReport("walk", identity, 0.0, 1.0, (0.0, 0.0), 0.0, 0.01)
    report = PerformanceReport((identity,), identity, 1.0, 31, 0.01, True, (walk,), (), feet)
    return report.document()


def test_feet_without_stances_are_told_in_full():
    document = reported(FeetResult())
    CHECK.validate(document)
    assert document["feet"]["stances"] == [] and document["feet"]["left"] == []


def test_feet_as_predicted_are_left_out():
    document = reported(None)
    CHECK.validate(document)
    assert "feet" not in document
