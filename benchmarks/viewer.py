"""How long the viewer takes: from the message of a slider until the scene's answer is back, on the wall.

`python -m benchmarks.viewer MECHANISM [MOTION]` runs `polypod view` in a process of its own and is the
page that its messages go to, so that the times hold what the socket and viser cost, but no drawing.
"""

import os
import subprocess
import sys
import time

import msgspec
import numpy as np
import viser
import zstandard
from websockets.sync.client import connect

CHANGES = 300
DRAGGING, SINGLE = 1.0 / 60.0, 0.4
"""Time between an answer and the next change, s: of a hand that drags, and of one that waits. The page
works out the nearest singular values a quarter of a second after the last change."""

_CAMERA = {
    **{"type": "ViewerCameraMessage", "wxyz": (1, 0, 0, 0), "position": (0, 0, 1), "fov": 0.7},
    **{"near": 0.1, "far": 9.0, "image_height": 9, "image_width": 9},
    **{"look_at": (0, 0, 0), "up_direction": (0, 0, 1)},
}


def serve(*arguments):
    """`polypod view`, and its address."""
    run = "from polypod.cli import main; main()"
    command = [sys.executable, "-c", run, "view", *arguments, "--port", "0"]
    environment = os.environ | {"PYTHONUNBUFFERED": "1"}
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
    line = server.stdout.readline()
    return server, line.split(" is at ")[1].split()[0]


def messages(socket, timeout):
    """The messages of the next bundle."""
    raw = socket.recv(timeout=timeout)
    size = int.from_bytes(raw[8:16], "little")
    return msgspec.msgpack.decode(zstandard.decompress(raw[16 : 16 + size]))["messages"]


def everything(socket, quiet=2.0):
    """All messages until there are none for a while."""
    found = []
    while True:
        try:
            found += messages(socket, quiet)
        except TimeoutError:
            return found


def sweep(socket, slider, platform, pause):
    """Times (CHANGES,) of answers, s, while a slider goes 2 mm to each side by steps of 0.1 mm."""
    times, start = [], slider["value"]
    for i in range(CHANGES):
        time.sleep(pause)
        value = round(start + 0.1 * (i % 40 - 20 if i // 40 % 2 else 20 - i % 40), 1)
        sent = time.perf_counter()
        change = {"type": "GuiUpdateMessage", "uuid": slider["uuid"], "updates": {"value": value}}
        socket.send(msgspec.msgpack.encode(change))
        while not any(
            each["type"] == "SetPositionMessage" and each["name"] == platform
            for each in messages(socket, 10.0)
        ):
            pass
        times.append(time.perf_counter() - sent)
    return np.array(times)


def main(*arguments):
    server, url = serve(*arguments)
    try:
        protocol = f"viser-v{viser.__version__}"
        with connect(
            url.replace("http", "ws"), subprotocols=[protocol], max_size=None, compression=None
        ) as socket:
            socket.send(msgspec.msgpack.encode(_CAMERA))
            told = everything(socket)
            slider = next(
                {"uuid": each["uuid"], "value": each["value"]}
                for each in told
                if each["type"] == "GuiSliderMessage" and each["props"]["label"].startswith("x /")
            )
            places = [each["name"] for each in told if each["type"] == "SetPositionMessage"]
            machine = [name for name in places if name.startswith("/machine/")]
            platform = max(machine, key=lambda name: int(name.split("/")[2]))
            for words, pause in (("dragging", DRAGGING), ("single changes", SINGLE)):
                times = 1e3 * sweep(socket, slider, platform, pause)
                low, high = np.percentile(times, [50, 95])
                load = os.getloadavg()[0]
                print(f"{words}: median {low:.1f} ms, 95 % {high:.1f} ms, load {load:.1f}", flush=True)
    finally:
        server.terminate()
        server.wait()


if __name__ == "__main__":
    main(*sys.argv[1:])
