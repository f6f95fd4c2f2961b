// Where the sun stands during the day of a lighting, whether it shines or not: asked of the daemon once a day and
// place.
import { Newest } from "lambert-light";
import type { Api } from "../daemon/api.ts";
import type { SunPositions } from "../daemon/daylight.ts";
import type { SkyLight } from "../state/state.ts";
import { hourOfYear } from "./dates.ts";
import { placeOf } from "./sky_request.ts";

/** Positions an hour; between two of them the sun is off its mean by .03 degrees at most. */
const PER_HOUR = 4;

const RADIANS = Math.PI / 180;

interface Day {
    key: string;
    light: SkyLight;
}

export class SunPath {
    private known: { key: string; at: SunPositions } | null = null;
    private wanted = "";
    private readonly asker: Newest<Day, SunPositions>;

    /** `changed` is called when positions have come. */
    constructor(api: Pick<Api, "sunPositions">, changed: () => void, fail: (reason: unknown) => void) {
        const hours = Array.from({ length: 24 * PER_HOUR + 1 }, (_, k) => k / PER_HOUR);
        this.asker = new Newest(
            ({ light }) => api.sunPositions(placeOf(light), hours.map((hour) => hourOfYear(light.day, hour))),
            (at, { key }) => {
                this.known = { key, at };
                changed();
            },
            (reason) => {
                this.wanted = "";
                fail(reason);
            },
            1,
        );
    }

    want(light: SkyLight): void {
        const key = keyOf(light);
        if (key === this.wanted) return;
        this.wanted = key;
        this.asker.want({ key, light });
    }

    /** Degrees; null: not known yet. */
    at(light: SkyLight, hour = light.hour): { azimuth: number; altitude: number } | null {
        if (this.known?.key !== keyOf(light)) return null;
        const { azimuth, altitude } = this.known.at, first = Math.min(Math.floor(hour * PER_HOUR), 24 * PER_HOUR - 1),
            share = hour * PER_HOUR - first;
        const sum = [0, 0, 0];
        for (const [k, weight] of [[first, 1 - share], [first + 1, share]]) {
            const [a, h] = [azimuth[k] * RADIANS, altitude[k] * RADIANS];
            [Math.cos(h) * Math.sin(a), Math.cos(h) * Math.cos(a), Math.sin(h)].forEach((v, d) => sum[d] += weight * v);
        }
        return { azimuth: Math.atan2(sum[0], sum[1]) / RADIANS,
            altitude: Math.atan2(sum[2], Math.hypot(sum[0], sum[1])) / RADIANS };
    }
}

const keyOf = (light: SkyLight): string => JSON.stringify([placeOf(light), light.day]);
