"""The main job as a client sees it: start a service, ask for clips over HTTP, keep and show them.

    python clients/demo.py MODEL.onnx FOLDER

Needs nothing but Python's own library and the `posefield` command. Ends by itself.
"""

import argparse
import json
import os
import subprocess
import sys
import urllib.error
import urllib.parse
import urllib.request
from email.message import Message
from pathlib import Path

FORMATS = ("usdc", "usda", "usdz", "bvh", "json")
PLAYER = Path(__file__).with_name("player.html")


def main() -> None:
    """Serve the model, fetch a clip in every format, and a page that plays it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("model", type=Path)
    parser.add_argument("folder", type=Path)
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    server, address = start(given.model)
    try:
        show(address, given.model.stem, given.folder)
    finally:
        server.terminate()
        server.wait(timeout=20)


def start(model: Path) -> tuple[subprocess.Popen[str], str]:
    """Service on a free port, and its address, once it listens."""
    command = [Path(sys.executable).with_name("posefield"), "serve", model, "--port", "0"]
    # What is said of the answers is for people here, and no log.
    quiet = {**os.environ, "POSEFIELD_LOG": "off"}
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=quiet)
    assert server.stdout is not None
    line = server.stdout.readline()
    if " at http" not in line:
        sys.exit(f"the service did not start: exit code {server.wait()}")
    return server, line.split(" at ")[1].strip()


def show(address: str, model: str, folder: Path) -> None:
    """Ask for the clip in the middle of the controls' ranges and write all that comes back."""
    card = json.loads(fetch(f"{address}/v1/models/{model}")[0])
    controls = {c["name"]: c["default"] for c in card["controls"]}
    query = urllib.parse.urlencode(controls)
    print(f"asked {address} for {model} with {query}")
    for kind in FORMATS:
        url = f"{address}/v1/models/{model}/clip.{kind}?{query}"
        content, headers = fetch(url)
        file = folder / f"{model}.{kind}"
        file.write_bytes(content)
        print(f"  {file}  {len(content):,} bytes  {headers['Content-Type']}")
    page = folder / f"{model}.html"
    clip = (folder / f"{model}.json").read_text(encoding="utf-8")
    page.write_text(PLAYER.read_text(encoding="utf-8").replace("null/*CLIP*/", clip))
    print(f"  {page}  plays it in a browser; the USD files open in Blender, Omniverse or usdview")
    sigma = json.loads(clip)["trust"]["sigma"]
    print(f"a captured clip at these controls would lie about {100 * sigma:.1f} cm from this one")


def fetch(url: str) -> tuple[bytes, Message]:
    """Body and headers of an answer; a refusal ends the demo with what the service says."""
    try:
        with urllib.request.urlopen(url, timeout=30) as answer:
            return answer.read(), answer.headers
    except urllib.error.HTTPError as refusal:
        sys.exit(f"{url}: {refusal.read().decode()}")


if __name__ == "__main__":
    main()
