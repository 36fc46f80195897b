import io
import zipfile

import pytest
from pxr import Usd, UsdSkel

from service.encode import usd, usdz


@pytest.fixture(scope="module")
def archive(walk):
    return usdz.usdz(walk)


def test_the_archive_holds_the_binary_layer_alone(archive, walk):
    with zipfile.ZipFile(io.BytesIO(archive)) as found:
        assert found.testzip() is None
        (entry,) = found.infolist()
        assert (entry.filename, entry.compress_type) == ("clip.usdc", zipfile.ZIP_STORED)
        assert entry.date_time == (1980, 1, 1, 0, 0, 0)
        assert found.read(entry) == usd.usdc(walk)


def test_the_data_are_aligned(archive, walk):
    assert archive.index(usd.usdc(walk)) % 64 == 0


@pytest.mark.parametrize("before", range(64))
def test_any_name_can_be_padded(before):
    padding = usdz._padding(before)
    assert (before + len(padding)) % 64 == 0
    assert len(padding) == 4 + int.from_bytes(padding[2:4], "little")


def test_pxr_opens_it(archive, tmp_path):
    path = tmp_path / "clip.usdz"
    path.write_bytes(archive)
    stage = Usd.Stage.Open(str(path))
    assert stage.GetDefaultPrim().IsA(UsdSkel.Root)
    assert len(stage.GetAttributeAtPath("/Character/Anim.rotations").GetTimeSamples()) == 45
