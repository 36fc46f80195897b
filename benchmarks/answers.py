"""Record what the service and its commands answer, and compare two recordings byte for byte.

    .venv/bin/python benchmarks/answers.py record MODELS OUT [--posefield .venv/bin/posefield]
    .venv/bin/python benchmarks/answers.py compare BEFORE AFTER

MODELS is a folder of model files. A recording is a folder: `answers.jsonl` with one line for each
question (status, headers, SHA-256 of the body) and the bodies by their digest. Only public
addresses and commands are used, so that commits whose modules differ can be compared.
"""

import argparse
import gzip
import hashlib
import itertools
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import httpx

POSES = ("json", "msgpack", "npz", "arrow")
CLIPS = ("usda", "usdc", "usdz", "json", "bvh", "glb", "npz", "arrow", "msgpack")
CROWDS = ("arrow", "npz", "msgpack", "json")
USD = ("usda", "usdc", "usdz")
# What differs between two runs of the same code, or with the code's own hash.
DROPPED = {"date", "server", "etag", "x-request-id", "content-length", "age", "server-timing"}
TIMES = re.compile(
    rb'"(instance|changed)":"[^"]*"|"seconds": [0-9.e-]+|"seconds_per_pose": \[[^\]]*\]'
    rb"|here [0-9.]+ .{1,3}s a pose|in [0-9.]+ s, [0-9]+ a second"
)
"""Identifiers of requests and measured times, which differ between runs of the same code."""
POINTS = 4

Question = tuple[str, str, str, dict[str, str], Any]
"""Name, method, path with query, headers, JSON body."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("record", "compare"))
    parser.add_argument("first", type=Path)
    parser.add_argument("second", type=Path)
    parser.add_argument("--posefield", type=Path, default=Path(sys.executable).parent / "posefield")
    options = parser.parse_args()
    if options.what == "compare":
        sys.exit(compare(options.first, options.second))
    record(options.first.resolve(), options.second.resolve(), options.posefield.absolute())


def record(models: Path, out: Path, posefield: Path) -> None:
    """Ask everything and write the recording."""
    shutil.rmtree(out, ignore_errors=True)
    (out / "bodies").mkdir(parents=True)
    with (out / "answers.jsonl").open("w") as lines:
        for name, answer in itertools.chain(asked(models, posefield), ran(models, posefield)):
            body = answer.pop("body")
            digest = hashlib.sha256(body).hexdigest()
            path = out / "bodies" / f"{digest}.gz"
            if not path.exists():
                path.write_bytes(gzip.compress(body, 1, mtime=0))
            lines.write(json.dumps({"name": name, **answer, "sha256": digest}) + "\n")
            lines.flush()


def asked(models: Path, posefield: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    """Answers of a served folder of models."""
    settings = {"POSEFIELD_PORT": "0", "POSEFIELD_LOG": "off", "POSEFIELD_WORKERS": "1"}
    process = subprocess.Popen(
        [str(posefield), "serve", str(models)],
        env={**os.environ, **settings, "ORT_DISABLE_TELEMETRY": "1"},
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout
        address = process.stdout.readline().split()[-1]
        with httpx.Client(base_url=address, timeout=300.0) as client:
            for name, method, path, headers, body in questions(client):
                answer = client.request(method, path, **_sent(headers, body))
                kept_headers = {k: v for k, v in answer.headers.items() if k not in DROPPED}
                content = TIMES.sub(b"", answer.content.replace(address.encode(), b"ADDRESS"))
                yield name, {"status": answer.status_code, "headers": kept_headers, "body": content}
    finally:
        process.terminate()
        process.wait()


def _sent(headers: dict[str, str], body: Any) -> dict[str, Any]:
    if body is None:
        return {"headers": headers}
    content = body if isinstance(body, bytes) else json.dumps(body).encode()
    return {"headers": {**headers, "content-type": "application/json"}, "content": content}


def questions(client: httpx.Client) -> Iterator[Question]:
    """Every question, always the same for the same models."""
    for path in ("/v1/models", "/openapi.json", "/openapi.yaml", "/problems", "/livez"):
        yield f"GET {path}", "GET", path, {}, None
    for name in sorted(model["name"] for model in client.get("/v1/models").json()["models"]):
        card = client.get(f"/v1/models/{name}").json()
        yield f"{name} card", "GET", f"/v1/models/{name}", {}, None
        yield from of_model(name, card)
    yield from wrong()


def of_model(name: str, card: dict[str, Any]) -> Iterator[Question]:
    """Questions to one model."""
    base, draw = f"/v1/models/{name}", random.Random(name)
    points = [_point(card, draw) for _ in range(POINTS)]
    joint = card["skeleton"]["names"][-1]
    for i, point in enumerate(points):
        for j, extra in enumerate(_extras(card, joint)):
            if i and j and (i + j) % POINTS:
                continue
            yield from _poses(f"{name} {i}.{j}", base, point, extra)
            yield from _clips(f"{name} {i}.{j}", base, point, extra)
    yield from _negotiated(name, base, points[0])
    yield from _many(name, base, points)
    yield from _grids(name, base, points[0])


def _point(card: dict[str, Any], draw: random.Random) -> dict[str, float]:
    controls = {}
    for control in card["controls"]:
        low, high = control["minimum"], control["maximum"]
        controls[control["name"]] = round(low + (high - low) * (0.1 + 0.8 * draw.random()), 4)
    return controls


def _extras(card: dict[str, Any], joint: str) -> list[dict[str, Any]]:
    performers = card.get("performers") or [None]
    target = {"joint": joint, "position": [0.2, 1.0, 0.3], "at": "end"}
    return [
        {},
        {"level": len(card.get("levels", [0])) - 1},
        {"performer": performers[0]} if performers[0] else {"extrapolate": "ok"},
        {"joint_sigma": True, "extrapolate": "ok"},
        {"exact": "none"},
        {"targets": [target], "extrapolate": "ok"},
    ]


def _query(values: dict[str, Any]) -> str:
    pairs: list[tuple[str, Any]] = []
    for key, value in values.items():
        if key == "targets":
            for one in value:
                position = ",".join(map(str, one["position"]))
                pairs.append(("target", f"{one['joint']}@{one['at']}:{position}"))
        elif key == "time" and isinstance(value, list):
            pairs += [("time", one) for one in value]
        else:
            pairs.append((key, str(value).lower() if isinstance(value, bool) else value))
    return urlencode(pairs)


def _poses(
    tag: str, base: str, point: dict[str, float], extra: dict[str, Any]
) -> Iterator[Question]:
    for form in POSES:
        query = _query({"time": [0.1, 0.5], **point, **extra})
        yield f"{tag} GET pose.{form} {extra}", "GET", f"{base}/pose.{form}?{query}", {}, None
    body = {"controls": point, "times": [0.0, 0.25, 0.7], **extra}
    yield f"{tag} POST pose {extra}", "POST", f"{base}/pose.msgpack", {}, body
    yield f"{tag} POST pose json {extra}", "POST", f"{base}/pose.json", {}, body


def _clips(
    tag: str, base: str, point: dict[str, float], extra: dict[str, Any]
) -> Iterator[Question]:
    for form in CLIPS:
        query = _query({**point, **extra, "fps": 24})
        yield f"{tag} GET clip.{form} {extra}", "GET", f"{base}/clip.{form}?{query}", {}, None
    for form, more in (
        ("usdc", {"start": 0.1, "end": 0.5}),
        ("usda", {"unit": "cm", "up": "z"}),
        ("bvh", {"names": "mixamo"}),
        ("glb", {"root": "in_place"}),
        ("json", {"loop": True}),
        ("json", {"names": "own", "root": "travelling", "fps": 60.0}),
    ):
        query = _query({**point, **extra, **more})
        yield (
            f"{tag} GET clip.{form} {extra} {more}",
            "GET",
            f"{base}/clip.{form}?{query}",
            {},
            None,
        )
        body = {"controls": point, **extra, **more}
        yield f"{tag} POST clip.{form} {extra} {more}", "POST", f"{base}/clip.{form}", {}, body


def _negotiated(name: str, base: str, point: dict[str, float]) -> Iterator[Question]:
    for accept in (
        "*/*",
        "application/json",
        "application/vnd.msgpack",
        "model/vnd.usdc",
        "text/html",
        "model/gltf-binary;q=0.4, model/vnd.usda",
    ):
        for what, query in (("clip", point), ("pose", {"time": 0.2, **point})):
            path = f"{base}/{what}?{urlencode(query)}"
            yield f"{name} GET {what} accept {accept}", "GET", path, {"accept": accept}, None
    for coding in ("gzip", "zstd"):
        path = f"{base}/clip.usda?{urlencode(point)}"
        yield f"{name} clip {coding}", "GET", path, {"accept-encoding": coding}, None
    yield f"{name} HEAD clip", "HEAD", f"{base}/clip.usdc?{urlencode(point)}", {}, None
    yield f"{name} OPTIONS clip", "OPTIONS", f"{base}/clip.usdc", {}, None


def _many(name: str, base: str, points: list[dict[str, float]]) -> Iterator[Question]:
    clips = [{"controls": point, "fps": 12} for point in points]
    for pack, form in itertools.product(("zip", "tar"), CLIPS):
        body = {"format": form, "clips": clips}
        yield f"{name} clips.{pack} {form}", "POST", f"{base}/clips.{pack}", {}, body
    columns = {key: [point[key] for point in points] for key in points[0]}
    crowd = {"controls": columns, "time": [0.1, 0.2, 0.3, 0.4], "extrapolate": "ok"}
    camera = {"position": [0.0, 1.6, 8.0], "fov": 1.0, "height": 1080.0}
    for form in CROWDS:
        yield f"{name} crowd.{form}", "POST", f"{base}/crowd.{form}", {}, crowd
        automatic = {**crowd, "level": "auto", "camera": camera, "heading": 0.5}
        yield f"{name} crowd.{form} seen", "POST", f"{base}/crowd.{form}", {}, automatic
        fixed = {**crowd, "level": 1.0, "position": [[1.0, 0.0, 2.0]] * 4, "root": "in_place"}
        yield f"{name} crowd.{form} placed", "POST", f"{base}/crowd.{form}", {}, fixed
    for form, sharing in itertools.product(USD, ("references", "scenegraph", "flatten")):
        query = urlencode({"count": 4, "seconds": 1, "seed": 3, "instancing": sharing})
        yield f"{name} GET crowd.{form} {sharing}", "GET", f"{base}/crowd.{form}?{query}", {}, None


def _grids(name: str, base: str, point: dict[str, float]) -> Iterator[Question]:
    names = list(point)
    across, along = names[0], names[-1]
    rest = {key: point[key] for key in names if key not in (across, along)}
    for form in POSES:
        query = urlencode({"across": across, "along": along, "columns": 5, "rows": 4, **rest})
        yield f"{name} GET sigma.{form}", "GET", f"{base}/sigma.{form}?{query}", {}, None
        body = {
            "across": across,
            "along": along,
            "columns": 6.0,
            "rows": 3,
            "controls": rest,
            "margin": 0.2,
        }
        yield f"{name} POST sigma.{form}", "POST", f"{base}/sigma.{form}", {}, body
    for nearest in (1, 3, 8):
        query = urlencode({**point, "nearest": nearest})
        yield f"{name} GET why {nearest}", "GET", f"{base}/why?{query}", {}, None
        body = {"controls": point, "nearest": nearest}
        yield f"{name} POST why {nearest}", "POST", f"{base}/why", {}, body
    for count in (1, 4):
        yield f"{name} suggestions {count}", "GET", f"{base}/suggestions?count={count}", {}, None


def wrong() -> Iterator[Question]:
    """Questions that are refused."""
    base = "/v1/models/reaching"
    right = "stature=1.75&hip_height=0.8285&turn=15&target_height=1.02"
    for what in (
        "pose.json",
        "clip.usdc",
        "sigma.json",
        "why",
        "suggestions",
        "clips.zip",
        "crowd.usda",
        "pose",
        "clip",
        "crowd.json",
    ):
        for query in (
            "",
            right,
            f"time=0&{right}&turn=3",
            f"time=x&{right}",
            f"time=-1&{right}",
            f"time=0&{right}&nonsense=2",
            f"time=0&{right}&level=x",
            f"time=0&{right}&level=99",
            f"time=0&{right}&extrapolate=no",
            f"time=0&{right}&joint_sigma=yes",
            f"time=0&{right}&target=a",
            f"time=0&{right}&target=hand@end=1,2,3",
            f"time=0&{right}&exact=turn",
            f"time=0&{right}&performer=nobody",
            "time=0&stature=9e9",
        ):
            yield f"wrong GET {what}?{query}", "GET", f"{base}/{what}?{query}", {}, None
        for body in (
            b"",
            b"{",
            b"[]",
            b'{"controls":{"turn":"x"},"times":[0]}',
            b'{"controls":{},"times":[],"clips":[],"format":"x"}',
            b'{"controls":{"turn":1e400},"time":0}',
            b'{"unknown":1}',
            b'{"controls":{},"times":[0],"level":0.5}',
            b'{"controls":{},"times":[0],"targets":[{"joint":"a","position":[0,0,0]}]}',
            b'{"controls":{},"fps":-1}',
            b'{"controls":{},"loop":3}',
        ):
            yield f"wrong POST {what} {body!r}", "POST", f"{base}/{what}", {}, body
    for path in (
        "/v1/models/nobody",
        "/v1/models/nobody/clip.usdc",
        "/v1/models/reaching/clip.fbx",
        "/v1/models/reaching/nothing",
        "/nothing",
        "/v1",
        "/v1/models/reaching@0/clip.usdc",
    ):
        for method in ("GET", "POST", "PUT", "DELETE"):
            yield f"wrong {method} {path}", method, path, {}, None


def ran(models: Path, posefield: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the output and the files of each command, by its name."""
    for model in sorted(models.glob("*.onnx")):
        for words in commands(model, posefield):
            with tempfile.TemporaryDirectory() as folder:
                yield (
                    f"command {model.stem} {' '.join(words[:1] + words[2:])}",
                    _run([str(posefield), *words], Path(folder), models),
                )


def commands(model: Path, posefield: Path) -> Iterator[list[str]]:
    """Words of commands for one model, run in an empty folder."""
    file = str(model)
    yield ["inspect", file]
    yield ["inspect", file, "--json"]
    card = json.loads(
        subprocess.run(
            [str(posefield), "inspect", file, "--json"],
            check=True,
            capture_output=True,
            text=True,
        ).stdout
    )
    point = _point(card, random.Random(model.stem))
    controls = [word for name, value in point.items() for word in ("-c", f"{name}={value}")]
    for form in CLIPS:
        yield ["clip", file, *controls, "-o", f"a.{form}", "--json"]
    yield ["clip", file, *controls, "-o", "a.usda", "--pin-feet", "--unit", "cm", "--up", "z"]
    yield ["clip", file, *controls, "-o", "a.usda", "--fps", "60", "--start", "0.1", "--end", "0.4"]
    yield ["clip", file, "-c", "nothing=1", "-o", "a.usda"]
    for extra in ([], ["--joint-sigma"], ["--level", "1"], ["--exact", "none"]):
        yield ["pose", file, *controls, "--time", "0.2", "--time", "0.4", *extra]
    yield ["why", file, *controls, "--json"]
    yield ["suggest", file, "--json"]
    for form in (*USD, "usd", "npz"):
        yield ["crowd", file, "-o", f"c.{form}", "--count", "3", "--seconds", "1", "--json"]
    first = next(iter(point))
    for form in ("usdc", "json"):
        yield ["export", file, "-o", "out", "--sample", "5", "--format", form, "--json"]
    for layout in ("library", "zip", "tar"):
        yield ["export", file, "-o", "out", "--sample", "3", "--layout", layout, "--workers", "1"]
    yield ["export", file, "-o", "out", "--grid", f"{first}={point[first]}", "--json"]


def _run(words: list[str], folder: Path, models: Path) -> dict[str, Any]:
    done = subprocess.run(words, cwd=folder, capture_output=True, check=False)
    pieces = [done.stdout, done.stderr]
    for path in sorted(p for p in folder.rglob("*") if p.is_file()):
        pieces += [str(path.relative_to(folder)).encode(), path.read_bytes()]
    body = b"\n".join(pieces).replace(str(folder).encode(), b"FOLDER")
    body = body.replace(str(models).encode(), b"MODELS")
    body = TIMES.sub(b"", body)
    return {"status": done.returncode, "headers": {}, "body": body}


def compare(before: Path, after: Path) -> int:
    """Print what differs; 1 if anything does."""
    first, second = (_lines(folder) for folder in (before, after))
    names = sorted(first.keys() | second.keys())
    differing = [name for name in names if first.get(name) != second.get(name)]
    for name in differing:
        if name not in second or name not in first:
            print(f"{name}: only {'before' if name in first else 'after'}")
        else:
            print(f"{name}: {_what(first[name], second[name])}")
    print(f"{len(first)} and {len(second)} answers, {len(differing)} differ")
    return int(bool(differing))


def _lines(folder: Path) -> dict[str, Any]:
    rows = map(json.loads, (folder / "answers.jsonl").read_text().splitlines())
    return {row.pop("name"): row for row in rows}


def _what(one: dict[str, Any], other: dict[str, Any]) -> str:
    keys = [key for key in ("status", "headers") if one[key] != other[key]]
    changes = [f"{key} {one[key]} -> {other[key]}" for key in keys]
    return "; ".join(changes + ["body"] * (one["sha256"] != other["sha256"]))


if __name__ == "__main__":
    main()
