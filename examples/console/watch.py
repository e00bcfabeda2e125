# Follows a console: `./photocoag console`, then this with the address it prints. Needs PyPI's websockets.
import json, re, sys
from websockets.sync.client import connect

host, token = re.match(r"http://([^/]+)/#token=(\w+)", sys.argv[1]).groups()
with connect(f"ws://{host}/ws?token={token}") as console:
    names = [column["name"] for column in json.loads(console.recv())["columns"]]  # "hello"
    for message in map(json.loads, console):
        for row in message.get("rows", []):
            cycle = dict(zip(names, row))
            print(cycle["cycle"], cycle["peak_estimate_K"], "K", cycle["power_command_W"], "W", flush=True)
