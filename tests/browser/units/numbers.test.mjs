// Numbers as people write them.
import assert from "node:assert/strict";
import { test } from "node:test";
import { sourceOf } from "../source.mjs";

test("a comma is a point, unless it parts thousands", async () => {
    const { withPoint } = await sourceOf("base/numbers");
    const cases = {
        ",": ".", "12,5": "12.5", "-0,25": "-0.25", "0,123": "0.123", ",5": ".5", "1.234,5": "1234.5", "1,2345": "1.2345",
        "1,234": "1234", "12,345,678": "12345678", "1,234.5": "1234.5", " 1,234 ": " 1234 ", "12.5": "12.5", "": "", "1e3": "1e3",
    };
    for (const [text, wanted] of Object.entries(cases)) assert.equal(withPoint(text), wanted, text);
});
