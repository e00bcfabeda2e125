"""The console's Foxglove stream in ten lines: foxglove.py ADDRESS (ws://…), as the program prints it."""
import json
import struct
import sys

from websockets.sync.client import connect

with connect(sys.argv[1], subprotocols=["foxglove.sdk.v1", "foxglove.websocket.v1"]) as client:
    print(json.loads(client.recv())["name"], "speaks", client.subprotocol)  # "serverInfo"
    channels = {channel["id"]: channel for channel in json.loads(client.recv())["channels"]}  # "advertise"
    wanted = [{"id": 100 + id, "channelId": id} for id in channels]
    client.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
    for message in client:
        opcode, subscription, unix_ns = struct.unpack_from("<BIQ", message)
        print(unix_ns, channels[subscription - 100]["topic"], json.loads(message[13:]), flush=True)
