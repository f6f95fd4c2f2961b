// Daemons and servers for the tests of Lambert's client in JavaScript, on free ports of the loopback. LAMBERTD names the program.
import { spawn } from "node:child_process";
import { createServer } from "node:http";
import { after } from "node:test";

const ends = [];
after(async () => {
    for (const end of ends.reverse()) await end();
});

/** lambertd: its address, `said` to wait for words of its standard output, and `end`. */
export async function startDaemon(...options) {
    const child = spawn(process.env.LAMBERTD, [...options, "--listen", "127.0.0.1:0"], { stdio: ["ignore", "pipe", "inherit"] });
    let text = "", heard = () => {};
    child.stdout.on("data", (bytes) => {
        text += bytes;
        heard();
    });
    const gone = new Promise((resolve) => child.once("exit", resolve));
    /** Until it has said the words so often. */
    const said = async (words, times = 1) => {
        while (text.split(words).length <= times) {
            const more = new Promise((resolve) => (heard = resolve));
            if (await Promise.race([more, gone.then(() => "gone")]) === "gone") throw new Error(`lambertd ended: ${text}`);
        }
    };
    const end = async (signal = "SIGTERM") => {
        if (child.exitCode === null && child.signalCode === null) child.kill(signal);
        await gone;
    };
    ends.push(end);
    await said("listening on");
    return { address: /listening on (http:\S+?)\/?\s/.exec(text)[1], said, end, signal: (name) => child.kill(name) };
}

/** A server that answers by `script`, functions of request and response; the last one stays. `asked` has its requests. */
export async function startFake(...script) {
    const asked = [];
    const server = createServer((request, response) => {
        asked.push(request);
        request.resume().on("end", () => (script.length > 1 ? script.shift() : script[0])(request, response));
    });
    await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
    ends.push(() => {
        server.closeAllConnections();
        return new Promise((resolve) => server.close(resolve));
    });
    return { address: `http://127.0.0.1:${server.address().port}`, asked };
}

/** An answer of a fake server. */
export const says = (status, body = "{}", headers = {}) => (_, response) => response.writeHead(status, headers).end(body);
