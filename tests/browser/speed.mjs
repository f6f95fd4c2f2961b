// How fast the page is on this machine; measured, never judged. In the folder `browser` of a build:
//   LAMBERTD=../lambertd node --preserve-symlinks --preserve-symlinks-main speed.mjs STORE...
// prints the time to the first picture, answers a second while the slider of all lamps is dragged, with the time of drawing
// counted apart (software draws here; a graphics card takes it off the processor), and what the daemon's memory grew by. Then
// what the page itself does, which a graphics card leaves to it: its script's time for a picture from another place and for one of
// another answer, the calls that draw, and the bytes that are uploaded for each. With CARD=vulkan (page.mjs) last of all a graphics
// card draws 1920 x 1080: pictures one after the other until all are done, and pictures a second while the view turns, as the
// browser paces them.
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { Daemon, openPage, settled } from "./page.mjs";

const DRAG_MS = 5000;
const middle = (values) => values.sort((a, b) => a - b)[values.length >> 1];

/** Changes the dimmer at each turn of the page's loop; resolves to figures by second. */
function drag(page, isDrawn) {
    return page.evaluate(async ([milliseconds, draws]) => {
        const { store, scene, scene: { stage, stage: { draw } } } = window.lambert, start = performance.now(), first = scene.answers;
        let drawing = 0, frames = 0;
        // A page that is not seen is not painted either: without a graphics card that takes both cores from the daemon.
        document.body.hidden = !draws;
        stage.draw = (...size) => {
            if (!draws) return;
            const from = performance.now();
            draw.apply(stage, size);
            stage.renderer.getContext().finish();
            drawing += performance.now() - from;
            frames += 1;
        };
        for (let i = 0; performance.now() - start < milliseconds; i++) {
            const { now } = store;
            store.change({ ...now, lighting: { ...now.lighting, dim: 0.3 + 0.001 * (i % 700) } }, "drag");
            await new Promise((resolve) => { setTimeout(resolve, 4); });
        }
        stage.draw = draw;
        document.body.hidden = false;
        const seconds = (performance.now() - start) / 1000;
        return { answers: (scene.answers - first) / seconds, apart: (scene.answers - first) / (seconds - drawing / 1000), frames: frames / seconds };
    }, [DRAG_MS, isDrawn]);
}

/** Medians of the script's time, ms, and counts, of pictures that are drawn one by one; the time until they are done is left out. */
function work(page, pictures) {
    return page.evaluate(async (count) => {
        const { store, scene, scene: { stage, cameras }, ask } = window.lambert, gl = stage.renderer.getContext(), counted = { calls: 0, bytes: 0 };
        for (const name of ["drawElements", "drawArrays"]) {
            const own = gl[name];
            gl[name] = (...args) => { counted.calls += 1; own.apply(gl, args); };
        }
        for (const name of ["texImage2D", "texSubImage2D", "bufferData", "bufferSubData"]) {
            const own = gl[name];
            gl[name] = (...args) => { counted.bytes += args.find((a) => ArrayBuffer.isView(a))?.byteLength ?? 0; own.apply(gl, args); };
        }
        const { draw } = stage, middle = (values) => values.sort((a, b) => a - b)[values.length >> 1];
        stage.draw = () => undefined;
        const figures = { move: [], answer: [] }, counts = {};
        const picture = () => {
            const from = performance.now();
            draw.call(stage);
            const spent = performance.now() - from;
            gl.finish();
            return spent;
        };
        picture();
        const { show } = scene;
        let taken = 0;
        scene.show = (...args) => {
            const from = performance.now();
            show.apply(scene, args);
            taken = performance.now() - from;
        };
        for (let i = 0; i < count; i++) {
            Object.assign(counted, { calls: 0, bytes: 0 });
            cameras.camera.position.x += 1e-4;
            cameras.camera.updateMatrixWorld();
            figures.move.push(picture());
            counts.move = { ...counted };
            const { now } = store, { answers } = scene;
            store.change({ ...now, lighting: { ...now.lighting, dim: 0.3 + 0.01 * (i % 50) } }, "drag");
            while (scene.answers === answers || !ask.isIdle) await new Promise((resolve) => { setTimeout(resolve, 5); });
            Object.assign(counted, { calls: 0, bytes: 0 });
            figures.answer.push(picture() + taken);
            counts.answer = { ...counted };
        }
        scene.show = show;
        stage.draw = draw;
        return { move: middle(figures.move), answer: middle(figures.answer), counts };
    }, pictures);
}

/** Milliseconds a picture from another place and with other values, by the card alone; pictures a second as they are shown. */
function cardWork(page, pictures) {
    return page.evaluate(async (count) => {
        const { stage, cameras, fields } = window.lambert.scene, gl = stage.renderer.getContext(), pixel = new Uint8Array(4);
        const finish = () => gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
        const pause = () => new Promise((resolve) => { setTimeout(resolve, 400); });
        const each = async (change) => {
            await pause();
            finish();
            const from = performance.now();
            for (let k = 0; k < count; k++) {
                change();
                stage.draw();
            }
            finish();
            return (performance.now() - from) / count;
        };
        const turn = () => {
            void cameras.controls.rotate(0.01, 0, false);
            cameras.controls.update(0.016);
        };
        const move = await each(turn), answer = await each(() => { stage.setField(0, fields[0]); });
        await pause();
        const start = performance.now(), { frames } = stage;
        while (performance.now() - start < 4000) {
            turn();
            stage.invalidate();
            await new Promise((resolve) => { requestAnimationFrame(resolve); });
        }
        const info = gl.getExtension("WEBGL_debug_renderer_info");
        return { move, answer, shown: 1000 * (stage.frames - frames) / (performance.now() - start), by: gl.getParameter(info.UNMASKED_RENDERER_WEBGL) };
    }, pictures);
}

test("speed", async () => {
    for (const store of process.argv.slice(2)) {
        const daemon = await Daemon.start([store]);
        const memory = () => Number(/RssAnon:\s+(\d+)/.exec(readFileSync(`/proc/${daemon.process.pid}/status`, "utf8"))[1]) / 1024;
        const before = memory(), page = await openPage(daemon.address), firsts = [];
        const { elements, channels } = await page.evaluate(() => window.lambert.scene.now.description);
        for (let i = 0; i < 5; i++) {
            const start = performance.now();
            await page.goto(`${daemon.address}/?inspect&${i}`);
            await settled(page);
            firsts.push(performance.now() - start);
        }
        const undrawn = await drag(page, false);
        await settled(page);
        const drawn = await drag(page, true);
        console.log(`${store}: ${elements} elements x ${channels}; first picture ${Math.round(middle(firsts))} ms (median of 5); `
            + `${undrawn.answers.toFixed(0)} answers/s applied without drawing, ${drawn.answers.toFixed(0)} beside `
            + `${drawn.frames.toFixed(1)} pictures/s by software (${drawn.apart.toFixed(0)} with the time of drawing counted apart); `
            + `daemon +${(memory() - before).toFixed(1)} MiB`);
        await settled(page);
        const { move, answer, counts } = await work(page, 30);
        const told = (of) => `${of.calls} calls that draw, ${of.bytes.toLocaleString("en-US")} bytes uploaded`;
        console.log(`${store}: script ${move.toFixed(1)} ms for a picture from another place (${told(counts.move)}), ${answer.toFixed(1)} ms for one of another `
            + `answer (${told(counts.answer)}); medians of 30`);
        if (process.env.CARD !== undefined) {
            await page.setViewportSize({ width: 1920, height: 1080 });
            await settled(page);
            const card = await cardWork(page, Number(process.env.PICTURES ?? 120));
            console.log(`${store}: ${card.by}: ${card.move.toFixed(1)} ms a picture from another place, ${card.answer.toFixed(1)} of other values, `
                + `${card.shown.toFixed(1)} pictures/s shown while the view turns`);
        }
        await page.context().close();
        await daemon.stop();
    }
});
