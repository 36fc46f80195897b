"""Tests of model reloads during requests: each gets the old or the new model."""

import shutil
import threading

import httpx
import pytest
from model_files import numbered
from serving import address, process, within

from posefield.model_file import checked_file

pytestmark = pytest.mark.system

VERSIONS = 4


@pytest.fixture
def folder(tmp_path, models):
    """A folder with one model, to be replaced."""
    (tmp_path / "models").mkdir()
    shutil.copy(models / "reach.onnx", tmp_path / "models")
    return tmp_path / "models"


@pytest.fixture
def replace(folder, models):
    """Function that puts version n of the model in place of it; its identity."""
    plain = (models / "reach.onnx").read_bytes()

    def by(number):
        content = numbered(plain, number)
        (folder / "aside").write_bytes(content)
        (folder / "aside").rename(folder / "reach.onnx")
        return f"reach@{checked_file.digest(content)}"

    return by


class Asking:
    """Threads that ask for poses without a pause; answers: (status, identity) in order."""

    def __init__(self, url, controls):
        self.answers, self.controls, self.ended = [], controls, False
        self.threads = [threading.Thread(target=self._ask, args=(url,)) for _ in range(3)]
        for thread in self.threads:
            thread.start()

    def _ask(self, url):
        with httpx.Client(base_url=url, timeout=30) as client:
            while not self.ended:
                answer = client.get("/v1/models/reach/pose", params={**self.controls, "time": 0})
                self.answers.append((answer.status_code, answer.json()["trust"]["model"]))

    def end(self):
        self.ended = True
        for thread in self.threads:
            thread.join()


@pytest.mark.parametrize("workers", ["1", "2"])
def test_requests_never_notice(workers, folder, replace, controls):
    with process(folder, POSEFIELD_RELOAD="1", POSEFIELD_WORKERS=workers) as child:
        url = address(child)
        asking = Asking(url, controls)
        expected = [httpx.get(url + "/v1/models/reach").json()["identity"]]
        for number in range(VERSIONS):
            expected.append(replace(number))
            last = (200, expected[-1])
            assert within(20, lambda last=last: asking.answers[-6:].count(last) == 6)
        asking.end()
        assert {status for status, _ in asking.answers} == {200}
        assert {identity for _, identity in asking.answers} == set(expected)
        # The last three still answer under their hash, those before no longer.

        def statuses():
            return [httpx.get(f"{url}/v1/models/{key}").status_code for key in expected]

        # A process may look a moment later than another.
        assert within(20, lambda: statuses() == [404] * (VERSIONS - 2) + [200] * 3), statuses()
        child.terminate()
        assert child.wait(20) == 0
        assert child.stderr.read() == b""
