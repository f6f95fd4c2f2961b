"""The Python package for asyncio: the numbers of lambert.Scene, many questions at once, and how they end."""

import asyncio
import os
import tempfile
import unittest

import numpy as np

from command import must
from daemon import Daemon
from lambert_python import TOKEN, PackageCase, lambert, random_emission


class Awaited(PackageCase):
    def run_with(self, name, ask):
        async def whole():
            async with await lambert.aio.open(f"{self.address}/{name}", token=TOKEN) as scene:
                return await ask(scene)

        return asyncio.run(whole())

    def test_same_numbers(self):
        box, office = self.scene("box"), self.scene("office")
        E = random_emission(box)

        async def of_box(scene):
            self.assertEqual((scene.n, scene.channels, scene.name, scene.names, scene.shape), (400, 3, "box", box.names, (3, 400)))
            return await asyncio.gather(
                scene.radiosity(E, limit=False), scene.irradiance({"lamp": 1}), scene.indirect(abs(E)), scene.adjoint([E, {"floor": 1}]),
                scene.reduce({"lamp": 1}, groups=["floor"], figures=("mean", "min")), scene.radiosity(np.stack([abs(E)] * 70)))

        signed, H, indirect, w, figures, many = self.run_with("box", of_box)
        np.testing.assert_allclose(signed, box.radiosity(E, limit=False), rtol=1e-6)
        np.testing.assert_array_equal(H, box.irradiance({"lamp": 1}))
        np.testing.assert_array_equal(indirect, box.indirect(abs(E)))
        np.testing.assert_array_equal(w, box.adjoint([E, {"floor": 1}]))
        self.assertEqual(figures["floor"].keys(), {"mean", "min"})
        np.testing.assert_array_equal(figures["floor"]["min"], box.reduce({"lamp": 1}, groups=["floor"], figures=("min",))["floor"]["min"])
        np.testing.assert_array_equal(many[69], box.radiosity(abs(E)))

        async def of_office(scene):
            return await asyncio.gather(scene.jacobian({"sensors": ["desks"]}, by="luminaires"),
                                        scene.radiosity({"luminaires": {"row": 1}}, select={"sensors": ["desks"]}))

        J, values = self.run_with("office", of_office)
        np.testing.assert_array_equal(J["luminaires"], office.jacobian({"sensors": ["desks"]}, by="luminaires")["luminaires"])
        self.assertEqual((values.shape, values.unit), ((100,), "lx"))

    def test_errors(self):
        async def wrong(scene):
            for words, ask in (("lmap", scene.radiosity({"lmap": 1})), (r"\[399\]", scene.radiosity(np.ones(399)))):
                with self.assertRaisesRegex(lambert.Refused, words):
                    await ask

        self.run_with("box", wrong)
        for error, where in ((lambert.NotFound, self.address + "/bex"), (lambert.Disconnected, "http://127.0.0.1:1/box"), (lambert.Refused, "box.h5"),
                             (lambert.Refused, self.address)):
            with self.assertRaises(error):
                asyncio.run(lambert.aio.open(where, token=TOKEN))

    def test_given_up(self):
        async def whole():
            answered, heads = asyncio.Event(), []

            async def serve(reader, writer):
                heads.append(await reader.readuntil(b"\r\n\r\n"))
                if len(heads) == 1:
                    writer.write(b'HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n9\r\n{"name":1\r\n')
                    writer.close()
                    return
                await reader.read()  # until the client leaves
                answered.set()
                writer.close()

            server = await asyncio.start_server(serve, "127.0.0.1", 0)
            port = server.sockets[0].getsockname()[1]
            with self.assertRaises(lambert.Disconnected):  # its answer ends before its end
                await lambert.aio.open(f"http://127.0.0.1:{port}/x")
            with self.assertRaisesRegex(lambert.TimedOut, "within 0.1 s"):
                await lambert.aio.open(f"http://127.0.0.1:{port}/x", timeout=.1)
            await answered.wait()
            answered.clear()
            task = asyncio.ensure_future(lambert.aio.open(f"http://127.0.0.1:{port}/x"))
            while len(heads) < 3:
                await asyncio.sleep(.001)
            task.cancel()
            with self.assertRaises(asyncio.CancelledError):
                await task
            await answered.wait()
            server.close()

        asyncio.run(whole())

    def test_chunked_and_closed_while_idle(self):
        text = b'{"name":"x","elements":1,"channels":1,"groups":[]}'

        async def whole():
            count = [0]

            async def serve(reader, writer):
                await reader.readuntil(b"\r\n\r\n")
                count[0] += 1
                body = b"".join(b"%x\r\n%s\r\n" % (len(part), part) for part in (text[:9], text[9:]))
                writer.write(b"HTTP/1.1 100 Continue\r\n\r\nHTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n" + body + b"0\r\n\r\n")
                writer.close()  # without a word of it

            server = await asyncio.start_server(serve, "127.0.0.1", 0)
            client = lambert.aio.Client(lambert.wire.Address.parse(f"http://127.0.0.1:{server.sockets[0].getsockname()[1]}"))
            for _ in range(3):
                self.assertEqual((await client.ask(lambert.wire.Request("GET", "/"))).json()["name"], "x")
            await client.close()
            server.close()
            self.assertEqual(count[0], 3)

        asyncio.run(whole())

    def test_replaced_and_killed(self):
        with tempfile.TemporaryDirectory() as folder:
            for name, size in (("room", 1), ("other", 2)):
                must("generate", "box", "--divisions", 3, "--size", f"1,1,{size}", "-o", os.path.join(folder, name + ".obj"))
                must("precompute", os.path.join(folder, name + ".obj"), "--probes", 0, "-o", os.path.join(folder, name + ".h5"), "--quiet")
            with Daemon(os.path.join(folder, "room.h5"), "--unix", os.path.join(folder, "socket"), listen=None) as daemon:
                async def whole():
                    scene = await lambert.aio.open(f"unix:{folder}/socket")
                    self.assertEqual((await scene.radiosity(np.ones(scene.n))).shape, (54,))
                    os.replace(os.path.join(folder, "other.h5"), os.path.join(folder, "room.h5"))
                    daemon.signal(1)
                    daemon.wait_for("serving room", 2)
                    with self.assertRaisesRegex(lambert.SceneChanged, "another geometry"):
                        await scene.radiosity(np.ones(scene.n))
                    daemon.kill()
                    with self.assertRaises(lambert.Disconnected):
                        await scene.adjoint(np.ones(scene.n))
                    await scene.close()

                asyncio.run(whole())


if __name__ == "__main__":
    unittest.main()
