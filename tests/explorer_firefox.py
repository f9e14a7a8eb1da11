"""Firefox as Playwright starts it, behind a relay that answers the one command that a release of long support lacks.

    python tests/explorer_firefox.py PROGRAM ARGUMENTS

Playwright drives a Firefox as it is installed by WebDriver BiDi, and in each context it sets the colours that pages
shall prefer (`emulation.setMediaFeaturesOverride`), which fails where the browser does not know the command. Here it
succeeds and does nothing: a preference of the profile says light. All else goes through as it is.
"""

import asyncio
import json
import re
import sys

import tornado.httpserver
import tornado.netutil
import tornado.web
import tornado.websocket

LEFT_OUT = "emulation.setMediaFeaturesOverride"
LISTENING = re.compile(r"(WebDriver BiDi listening on )(ws://\S+)")
LARGEST = 1 << 30


class Relay(tornado.websocket.WebSocketHandler):
    """Messages of Playwright to the browser, and back."""

    def initialize(self, address):
        self.address = address

    async def open(self, path):
        self.browser = asyncio.ensure_future(
            tornado.websocket.websocket_connect(self.address + path, max_message_size=LARGEST)
        )
        self.answers = asyncio.ensure_future(self.back(await self.browser))

    async def back(self, browser):
        while (message := await browser.read_message()) is not None:
            await self.write_message(message)
        self.close()

    async def on_message(self, message):
        given = json.loads(message)
        if given.get("method") == LEFT_OUT:
            await self.write_message(json.dumps({"type": "success", "id": given["id"], "result": {}}))
        else:
            await (await self.browser).write_message(message)

    def on_close(self):
        if self.browser.done():
            self.browser.result().close()


async def main(program, *arguments):
    """Start the browser, and tell where the relay listens in place of it."""
    browser = await asyncio.create_subprocess_exec(program, *arguments, stderr=asyncio.subprocess.PIPE)
    async for line in browser.stderr:
        text = line.decode("utf-8", "replace")
        found = LISTENING.search(text)
        if found:
            routes = [("(/.*)", Relay, {"address": found[2]})]
            server = tornado.httpserver.HTTPServer(tornado.web.Application(routes, websocket_max_message_size=LARGEST))
            sockets = tornado.netutil.bind_sockets(0, "127.0.0.1")
            server.add_sockets(sockets)
            text = text.replace(found[2], f"ws://127.0.0.1:{sockets[0].getsockname()[1]}")
        sys.stderr.write(text)
        sys.stderr.flush()
    return await browser.wait()


if __name__ == "__main__":
    sys.exit(asyncio.run(main(*sys.argv[1:])))
