"""Somebody who looks at a bridge, as Foxglove does, and has its page make a record meanwhile, until SIGTERM: viewer.py PORT TOPIC.
Prints, as JSON, what came and what was recorded."""
import http.client
import json
import pathlib
import re
import signal
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "bridge/web"))
from websocket import WebSocket

HOST = "127.0.0.1"
PATIENCE = 30


class Enough(Exception):
    pass


def stop(*_):
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    raise Enough


def record(port, do=None):
    """What the page knows of it."""
    connection = http.client.HTTPConnection(HOST, port, timeout=PATIENCE)
    body = json.dumps({"do": do}) if do else None
    connection.request("POST" if do else "GET", "/record", body, {"Content-Type": "application/json"} if do else {})
    answer = connection.getresponse()
    text = answer.read().decode()
    connection.close()
    if answer.status != 200:
        sys.exit(f"/record: {answer.status} {text}")
    return json.loads(text)


def connect(port):
    end = time.monotonic() + PATIENCE
    while True:
        try:
            return WebSocket(HOST, port, protocols=["foxglove.sdk.v1"])
        except ConnectionRefusedError:
            if time.monotonic() > end:
                raise
            time.sleep(0.05)


def main(port, topic):
    signal.signal(signal.SIGTERM, stop)
    figures = {"received": 0, "bytes": 0}
    try:
        viewer = connect(port)
        channel = None
        while channel is None:
            message = json.loads(viewer.receive())
            channel = next((one["id"] for one in message.get("channels", []) if one["topic"] == topic), None)
        viewer.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": 1, "channelId": channel}]}))
        record(port, "start")
        while True:
            message = viewer.receive()
            if isinstance(message, bytes):
                figures["received"] += 1
                figures["bytes"] += len(message)
    except Enough:
        pass
    record(port, "stop")
    while (recorded := record(port))["recording"]:
        time.sleep(0.05)
    last = recorded["last"]
    figures["lost"] = 0 if last["ok"] else 1
    figures["words"] = last["words"]
    figures["recorded"] = int((re.match(r"\d+", last["words"]) or [0])[0])  # messages
    print(json.dumps(figures))


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2])
