"""Publishes a video of fragmented MP4 over Media-over-QUIC (PyPI's moq-rs), as `clarus serve --output moq:URL` runs it:
python3 publish.py https://HOST:PORT/NAME[#SHA256]

On standard input: for every part of the stream its length and whether a player may begin there, two 32-bit numbers, and
its bytes; the first part is what a player begins with. On standard output a line: "ready", or what is wrong. The
broadcast NAME has one track, "video". Each of its groups begins with that first part and a key picture; each of a group's
frames is one part.
"""

import asyncio
import os
import signal
import struct
import sys
import time
from urllib.parse import urlsplit

answers = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)


def refuse(why):
    print(str(why).replace("\n", " "), file=answers, flush=True)
    sys.exit(1)


try:
    import moq
except ImportError as error:
    refuse(
        f"it needs PyPI's moq-rs ({error}); in a virtual environment: python3 -m venv moq && moq/bin/pip install moq-rs "
        "&& PATH=$PWD/moq/bin:$PATH clarus serve …"
    )


async def parts(stream):
    """(bytes, is_key), until the input ends."""
    while True:
        try:
            length, is_key = struct.unpack("=II", await stream.readexactly(8))
            yield await stream.readexactly(length), is_key
        except asyncio.IncompleteReadError:
            return


async def publish(url, stream):
    relay = f"https://{url.netloc}"
    options = {"tls_fingerprints": [url.fragment]} if url.fragment else {}
    if url.hostname in ("127.0.0.1", "localhost"):
        options["bind"] = "127.0.0.1:0"
    client = moq.Client(relay, websocket_enabled=False, **options)
    try:
        await asyncio.wait_for(client.__aenter__(), 5)
    except asyncio.TimeoutError:
        refuse(f"no relay has answered at {relay} in 5 s")
    except Exception as error:
        refuse(f"no relay at {relay}: {error}")
    broadcast = client.create_broadcast(url.path.strip("/"))
    track = broadcast.publish_track("video")
    broadcast.announce()
    print("ready", file=answers, flush=True)

    start, group = b"", None
    async for part, is_key in parts(stream):
        now = time.monotonic_ns() // 1000
        if not start:
            start = part
            continue
        if is_key:
            if group:
                group.finish()
            group = track.append_group()
            group.write_frame(start, now)
        group.write_frame(part, now)
    if group:
        group.finish()
    track.finish()
    await asyncio.sleep(0.5)  # what is on its way arrives
    await client.__aexit__()


async def main():
    url = urlsplit(sys.argv[1])
    if url.scheme != "https" or not url.hostname or not url.path.strip("/"):
        refuse("it is not of the form https://HOST:PORT/NAME")
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for whoever writes here, and then ends the input
    stream = asyncio.StreamReader(limit=1 << 26)
    await asyncio.get_running_loop().connect_read_pipe(lambda: asyncio.StreamReaderProtocol(stream), sys.stdin.buffer)
    await publish(url, stream)


asyncio.run(main())
