// The parts of Lambert's client that need no daemon: halves, NPY, addresses, the newest question, and its types.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import * as client from "../../../deploy/js/lambert.js";

const { connect, floatsToHalves, halfToNumber, halvesToFloats, LambertError, Newest, numberToHalf, readNpy, writeNpy } = client;

test("a number has the nearest half", () => {
    // Every half is its own nearest; between two neighbours the nearer one is taken, the even one in the middle.
    for (let bits = 0; bits < 0x7c00; bits++) {
        const value = halfToNumber(bits), next = halfToNumber(bits + 1);
        for (const sign of [1, -1]) assert.equal(numberToHalf(sign * value) & 0x7fff, bits);
        if (bits === 0x7bff) continue;
        const middle = (value + next) / 2;
        assert.equal(numberToHalf(middle), bits + (bits & 1));
        assert.equal(numberToHalf(value + 0.4375 * (next - value)), bits);
        assert.equal(numberToHalf(value + 0.5625 * (next - value)), bits + 1);
    }
    assert.deepEqual([65519, 65520, 1e9, -1e9, Infinity].map(numberToHalf), [0x7bff, 0x7c00, 0x7c00, 0xfc00, 0x7c00]);
    assert.ok(Number.isNaN(halfToNumber(numberToHalf(NaN))));
    assert.deepEqual([...halvesToFloats(floatsToHalves([1, -0.5, 3]), 1, 2, 2)], [-1, 6]);
});

test("arrays of NPY are read as they were written", () => {
    for (const [values, shape] of [[Float32Array.of(1, -2, 3.5, 0, 1e-9, 7), [2, 3]], [Float64Array.of(0.1, Math.PI), [2]], [new Float32Array(0), [0]]]) {
        const file = writeNpy(values, shape), { data, shape: read } = readNpy(file.buffer);
        assert.equal(file.length % 64, values.byteLength % 64);
        assert.deepEqual([data, read], [values, shape]);
    }
    assert.deepEqual(readNpy(writeNpy([1, 2]).buffer).data, Float32Array.of(1, 2));
    const file = writeNpy(Float32Array.of(1, 2)), of = (from, to) => Uint8Array.from(Buffer.from(Buffer.from(file).toString("latin1").replace(from, to), "latin1")).buffer;
    assert.deepEqual(readNpy(of("<f4", "<i4")).data, Int32Array.of(0x3f800000, 0x40000000));
});

test("files that are no NPY are refused", () => {
    const file = writeNpy(Float32Array.of(1, 2)), text = Buffer.from(file).toString("latin1");
    const of = (changed) => Uint8Array.from(Buffer.from(changed, "latin1")).buffer;
    for (const [changed, words] of [["<html>", /begin/], [text.slice(0, -1), /7 bytes of numbers, must have 8/], [text.replace("<f4", ">f4"), /its head is/],
        [text.replace("False", "True "), /its head is/], [text.replace("(2,)", "(3,)"), /8 bytes of numbers, must have 12/], ["", /begin/]])
        assert.throws(() => readNpy(of(changed)), (error) => error instanceof LambertError && error.kind === "not-npy" && words.test(error.message));
    assert.throws(() => writeNpy(Float32Array.of(1, 2), [3]), /2 numbers have not the shape \[3\]/);
});

test("an address is one", () => {
    assert.equal(connect("http://127.0.0.1:8317/").address, "http://127.0.0.1:8317");
    assert.equal(connect(new URL("https://example.org/light/?x#y")).address, "https://example.org/light");
    for (const wrong of ["127.0.0.1:8317", "ftp://example.org", "box.h5", ""])
        assert.throws(() => connect(wrong), /is no address such as http:\/\/127\.0\.0\.1:8317\/NAME/);
});

test("of the questions that wait the newest is asked", async () => {
    const asked = [], shown = [], failed = [];
    const newest = new Newest((what) => new Promise((resolve, reject) => asked.push({ what, resolve, reject })), (answer) => shown.push(answer), (why) => failed.push(why));
    for (let i = 0; i < 5; i++) newest.want(i);
    assert.deepEqual(asked.map(({ what }) => what), [0, 1]);
    asked[1].resolve("one");
    await new Promise(setImmediate);
    asked[0].resolve("zero, late");
    asked[2].reject("four");
    await new Promise(setImmediate);
    assert.deepEqual([asked.map(({ what }) => what), shown, failed, newest.isIdle], [[0, 1, 4], ["one"], ["four"], true]);
    newest.want(5);
    newest.forget();
    asked[3].resolve("five");
    await new Promise(setImmediate);
    assert.deepEqual([shown, newest.isIdle], [["one"], true]);
});

test("all that there is has a type", () => {
    const text = readFileSync(new URL("../../../deploy/js/lambert.d.ts", import.meta.url), "utf8");
    const typed = [...text.matchAll(/^export (?:class|function) (\w+)/gm)].map(([, name]) => name);
    assert.deepEqual(typed.sort(), Object.keys(client).sort());
    for (const [, name, body] of text.matchAll(/^export class (\w+)[^{]*\{\n(.*?)^\}/gms)) {
        const members = new Set([...body.matchAll(/^ {4}(?:get |private )?(\w+)(?:<[^(]*>)?\(/gm)].map(([, member]) => member));
        assert.deepEqual([...members].sort(), Object.getOwnPropertyNames(client[name].prototype).sort(), name);
    }
});
