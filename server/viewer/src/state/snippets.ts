// The request of what is shown as a command of curl and as a program in Python, which anybody can run.
import { Api, type Emission, type Quantity } from "../daemon/api.ts";
import type { Wanted } from "./request.ts";

/** Commands are limited to 128 KiB an argument by Linux; a longer body comes by standard input. */
const ARGUMENT_MOST = 100_000;

export interface PlainRequest {
    scene: string;
    body: { emission: Emission; quantity: Quantity; tolerance?: number };
}

/** The same request in the store's unit, as people write it: pages ask for light scaled to 1. Null: nothing shines. */
export function plainRequest(wanted: Wanted, tolerance: number | null): PlainRequest | null {
    if (wanted.emission === null) return null;
    const times = (value: unknown): unknown => {
        // Twelve digits undo the rounding of dividing and multiplying.
        if (typeof value === "number") return Number((value * wanted.scale).toPrecision(12));
        if (Array.isArray(value)) return value.map(times);
        const members = Object.entries(value as object);
        // Of a sun only its light is scaled.
        return Object.fromEntries(
            members.map((
                [name, inner],
            ) => [name,
                name === "sun" ? { ...inner, direct: times((inner as { direct: unknown }).direct) } : times(inner)]
            ),
        );
    };
    return {
        scene: wanted.scene,
        body: { emission: times(wanted.emission) as Emission, quantity: wanted.quantity,
            ...(tolerance === null ? {} : { tolerance }) },
    };
}

/** One word of a POSIX shell, whatever it holds. */
export function shellWord(text: string): string {
    return `'${text.replaceAll("'", "'\\''")}'`;
}

/** A string of Python, whatever it holds: that of JSON in ASCII. */
export function pythonString(text: string): string {
    return JSON.stringify(text).replace(/[^ -~]/gu, (c) => {
        const code = c.codePointAt(0) as number;
        return code > 0xffff ? `\\U${code.toString(16).padStart(8, "0")}` : `\\u${code.toString(16).padStart(4, "0")}`;
    });
}

function pythonValue(value: unknown): string {
    if (typeof value === "string") return pythonString(value);
    if (Array.isArray(value)) return `[${value.map(pythonValue).join(", ")}]`;
    if (typeof value === "object" && value !== null)
        return `{${
            Object.entries(value).map(([name, inner]) => `${pythonString(name)}: ${pythonValue(inner)}`).join(", ")
        }}`;
    return String(value);
}

const urlOf = (page: string, request: PlainRequest): string =>
    new URL(Api.path(request.scene, "/radiosity"), page).href;

/** The token itself stays out of what is copied: it is read from LAMBERT_TOKEN. */
export function curlCommand(page: string, request: PlainRequest, withToken: boolean): string {
    const body = JSON.stringify(request.body), isLong = new TextEncoder().encode(body).length > ARGUMENT_MOST;
    const parts = [`curl -sS --fail-with-body ${shellWord(urlOf(page, request))}`,
        "-H 'Content-Type: application/json'"];
    if (withToken) parts.push('-H "Authorization: Bearer $LAMBERT_TOKEN"');
    // A body of JSON has no line breaks, so no line of it ends the text.
    parts.push(isLong ? `--data-binary @- <<'BODY'\n${body}\nBODY` : `-d ${shellWord(body)}`);
    return `${parts.join(" \\\n  ")}\n`;
}

export function pythonProgram(page: string, request: PlainRequest, withToken: boolean): string {
    return [
        "import json",
        ...(withToken ? ["import os"] : []),
        "import urllib.request",
        "",
        `body = ${pythonValue(request.body)}`,
        "request = urllib.request.Request(",
        `    ${pythonString(urlOf(page, request))},`,
        "    json.dumps(body).encode(),",
        `    {"Content-Type": "application/json"${
            withToken ? ', "Authorization": "Bearer " + os.environ["LAMBERT_TOKEN"]' : ""
        }})`,
        "with urllib.request.urlopen(request) as answer:",
        "    answer = json.load(answer)",
        `values = answer[${
            pythonString(request.body.quantity)
        }]  # one number for each element, a list for each channel`,
        "print(json.dumps(values))",
        "",
    ].join("\n");
}
