"""Checks of the shipped nginx configuration as a cache: cached and uncached responses."""

import re
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Barrier

import httpx
import proxy
import running
import trained

from posefield.model_file import checked_file, onnx_file

# Another file of the same model: one more entry of metadata, field 14 of onnx.proto.
REMARK = onnx_file.encode_bytes(
    14, onnx_file.encode_bytes(1, b"remark") + onnx_file.encode_bytes(2, b"x")
)
# Seconds: of POSEFIELD_ALIAS_SECONDS and _RELOAD, and until what hangs on them must have happened.
AGAIN, PATIENCE = 1, 20.0
# Clips that twenty ask for at once: of one alone, chance may keep the others until it is there.
CLIPS = 10
# nginx counts whole seconds.
EXPIRED = AGAIN + 1.2
# Lines of our configuration, what stands in their place in one that is spoiled, and how a fault
# begins that is found in that.
SPOILED = {
    "proxy_cache_revalidate on;": ("", "asked again"),
    "proxy_cache_lock on;": ("", "twenty at once"),
    "proxy_no_cache $http_authorization;": ("", "who is known"),
    "proxy_hide_header X-Request-Id;": ("", "ids of two requests"),
    "server_tokens off;": ("proxy_ignore_headers Vary;", "sent as"),
}


@dataclass(frozen=True)
class Site:
    """The service and the cache before it."""

    service: httpx.Client
    cache: httpx.Client
    query: dict[str, float]

    def get(self, path: str, **headers: str) -> tuple[str, httpx.Response]:
        """Return the cache status of an answer, and the answer."""
        answer = self.cache.get(path, params=self.query, headers=headers)
        return answer.headers.get("x-cache-status", ""), answer

    def asked(self, form: str, status: int) -> int:
        """Count the service's own answers with a clip of that format."""
        labels = f'format="{form}",operation="getClipInFormat",status="{status}"'
        pattern = rf"^posefield_request_seconds_count{{{labels}}} (\S+)"
        found = re.search(pattern, self.service.get("/metrics").text, re.MULTILINE)
        return int(float(found[1])) if found else 0


def faults() -> list[str]:
    """Return the wrong and the missing actions of the cache, a line each."""
    return proxy.configuration_faults("cache", proxy.CONF.read_text(), SPOILED, _faults)


def _faults(text: str) -> list[str]:
    """Faults of a cache of this configuration."""
    with tempfile.TemporaryDirectory() as name, _sited(Path(name), text) as site:
        return [
            *_kept(site),
            *_asked_again(site, Path(name)),
            *_by_headers(site),
            *_never_kept(site),
            *_at_once(site),
        ]


def _kept(site: Site) -> Iterator[str]:
    path = f"/v1/models/{_identity(site)}/clip.usdc"
    direct = site.service.get(path, params=site.query)
    before = site.asked("usdc", 200)
    (first, made), (second, kept) = site.get(path), site.get(path)
    yield from _expected("under a hash", (first, second), ("MISS", "HIT"))
    yield from _expected("asked of the service", site.asked("usdc", 200) - before, 1)
    yield from _expected("the bytes", made.content == kept.content == direct.content, True)
    one, other = (answer.headers.get_list("x-request-id") for answer in (made, kept))
    yield from _expected("ids of two requests", len({*one, *other}), len(one + other))
    yield from _expected("ids of two requests", (len(one), len(other)), (1, 1))
    tag = kept.headers["etag"]
    status, held = site.get(path, **{"If-None-Match": tag})
    yield from _expected("to who has it", (status, held.status_code), ("HIT", 304))
    yield from _expected(
        "by a tag of old", site.get(path, **{"If-None-Match": '"x"'})[1].status_code, 200
    )


def _asked_again(site: Site, folder: Path) -> Iterator[str]:
    alias, old = "/v1/models/reaching/clip.usdc", _identity(site)
    first, made = site.get(alias)
    before = site.asked("usdc", 200), site.asked("usdc", 304)
    time.sleep(EXPIRED)
    second, again = site.get(alias)
    after = site.asked("usdc", 200), site.asked("usdc", 304)
    yield from _expected("under the name", (first, second), ("MISS", "REVALIDATED"))
    yield from _expected("asked again", (after[0] - before[0], after[1] - before[1]), (0, 1))
    yield from _expected("the same bytes", again.content == made.content, True)

    path = folder / "models/reaching.onnx"
    aside = folder / "new.onnx"
    aside.write_bytes(
        checked_file.append_checksum(path.read_bytes()[: -checked_file.CHECKSUM_SIZE] + REMARK)
    )
    aside.rename(path)
    end = time.monotonic() + PATIENCE
    while (new := _identity(site)) == old and time.monotonic() < end:
        time.sleep(0.1)
    time.sleep(EXPIRED)
    third, other = site.get(alias)
    yield from _expected(
        "of a new model", (third, other.headers["posefield-model"]), ("EXPIRED", new)
    )
    direct = site.service.get(alias, params=site.query).content
    yield from _expected("its bytes", other.content == direct != made.content, True)
    fourth, before_it = site.get(f"/v1/models/{old}/clip.usdc")
    yield from _expected("of the old", (fourth, before_it.content == made.content), ("HIT", True))


def _by_headers(site: Site) -> Iterator[str]:
    clip = f"/v1/models/{_identity(site)}/clip"
    for media_type in ("application/json", "model/gltf-binary", "application/x-bvh"):
        found = [site.get(clip, Accept=media_type) for _ in range(2)]
        yield from _expected(media_type, [status for status, _ in found], ["MISS", "HIT"])
        sent = [answer.headers["content-type"].partition(";")[0] for _, answer in found]
        yield from _expected(f"sent as {media_type}", sent, [media_type] * 2)
    for coding in ("identity", "gzip"):
        found = [site.get(f"{clip}.usda", **{"Accept-Encoding": coding}) for _ in range(2)]
        yield from _expected(coding, [status for status, _ in found], ["MISS", "HIT"])
        sent = [answer.headers.get("content-encoding", "identity") for _, answer in found]
        yield from _expected(f"sent in {coding}", sent, [coding] * 2)


def _never_kept(site: Site) -> Iterator[str]:
    identity = _identity(site)
    wrong = (
        (404, "/v1/models/nobody/clip.usdc"),
        (404, f"/v1/models/{identity}/clip.fbx"),
        (422, f"/v1/models/{identity}/clip.npz?level=99"),
    )
    for code, path in wrong:
        found = [site.cache.get(path) for _ in range(2)]
        said = [(each.status_code, each.headers["x-cache-status"]) for each in found]
        yield from _expected(path, said, [(code, "MISS")] * 2)
    path, known = f"/v1/models/{identity}/clip.npz", {"Authorization": "Bearer x"}
    said = [site.get(path, **headers)[0] for headers in (known, known, {}, known, {})]
    yield from _expected("who is known", said, ["BYPASS", "BYPASS", "MISS", "BYPASS", "HIT"])
    yield from _expected("/metrics", site.cache.get("/metrics").status_code, 404)
    yield from _expected(
        "/readyz", [site.cache.get("/readyz").headers["x-cache-status"] for _ in "ab"], ["MISS"] * 2
    )


def _at_once(site: Site) -> Iterator[str]:
    path, before = f"/v1/models/{_identity(site)}/clip.glb", site.asked("glb", 200)
    with ThreadPoolExecutor(20) as crowd:
        found = [_crowded(_at(site, 31.0 + i), crowd, path) for i in range(CLIPS)]
    asked = site.asked("glb", 200) - before
    yield from _expected("twenty at once", (set(found), asked), ({1}, CLIPS))


def _at(site: Site, fps: float) -> Site:
    return replace(site, query={**site.query, "fps": fps})


def _crowded(site: Site, crowd: ThreadPoolExecutor, path: str) -> int:
    """Count the different answers to twenty simultaneous requests."""
    together = Barrier(20)

    def ask() -> bytes:
        together.wait()
        return site.get(path)[1].content

    return len({each.result() for each in [crowd.submit(ask) for _ in range(20)]})


def _expected(what: str, found: object, expected: object) -> Iterator[str]:
    if found != expected:
        yield f"{what}: {found}, expected {expected}"


def _identity(site: Site) -> str:
    (model,) = site.service.get("/v1/models").json()["models"]
    return str(model["identity"])


@contextmanager
def _sited(folder: Path, text: str) -> Iterator[Site]:
    model, content = trained.family()
    (folder / "models").mkdir()
    (folder / "models/reaching.onnx").write_bytes(content)
    own, before = running.ports(2)
    told = {
        "POSEFIELD_PORT": str(own),
        "POSEFIELD_ALIAS_SECONDS": str(AGAIN),
        "POSEFIELD_RELOAD": str(AGAIN),
    }
    command = [Path(sys.executable).with_name("posefield"), "serve", folder / "models"]
    controls = {control.name: control.default for control in model.session.card.controls}
    with (
        running.started(command, folder / "service.txt", **told),
        running.started(proxy.command(folder, text, own, before), folder / "nginx.txt"),
        httpx.Client(base_url=f"http://127.0.0.1:{own}", timeout=30) as service,
        httpx.Client(base_url=f"http://127.0.0.1:{before}", timeout=30) as cache,
    ):
        running.wait(lambda: cache.get("/readyz").status_code == 200)
        yield Site(service, cache, controls)


if __name__ == "__main__":
    found = faults()
    print("\n".join(found) or "no fault in the cache before the service")
    sys.exit(bool(found))
