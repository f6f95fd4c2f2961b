// The sky of the scene that is open, from the tiles of its store and the weather beside it, and those of scenes that
// it is compared with.
import type { Api, Description } from "../daemon/api.ts";
import type { ExactSun } from "../state/request.ts";
import type { Lighting, SkyLight } from "../state/state.ts";
import type { Store } from "../state/store.ts";
import { SkySource, type SunParts } from "./source.ts";
import type { SkyAnswer } from "./tiles.ts";

export class SceneSky {
    readonly source = new SkySource();
    /** What the tiles are of: another scene may be shown before its own have come. */
    private open: Description | null = null;

    constructor(private readonly api: Pick<Api, "sky" | "weather">, private readonly store: Store,
        private readonly fail: (reason: unknown) => void)
    {}

    get isPhotometric(): boolean {
        return this.store.now.view.unit === "lx";
    }

    /** Of the tiles of a scene; null: it has no sky, or its tiles are not known. */
    radiances(lighting: Lighting, of: Description): readonly (number | number[])[] | null {
        const { source } = this, isOpen = of === this.open;
        if (of.sky === null || lighting.solo !== null || !(isOpen || source.knows(of.name))) return null;
        return source.radiances(lighting.sky, this.isPhotometric, of.channels, isOpen ? null : of.name);
    }

    /** The sky without its sun, and the sun itself, where the lighting wants that of the daemon and a scene has it: a
     * store of few emitters answers the sun by its tile alone. Else null. */
    exactSun(lighting: Lighting, of: Description): { sky: SunParts["sky"]; sun: ExactSun } | null {
        const { source } = this, isOpen = of === this.open;
        if (lighting.sky.sun !== "exact" || of.sky === null || lighting.solo !== null || (of.emitters?.length ?? 0) > 0)
            return null;
        if (!(isOpen || source.knows(of.name))) return null;
        const parts = source.parts(lighting.sky, this.isPhotometric, of.channels, isOpen ? null : of.name);
        if (parts === null) return null;
        const [east, north, up] = parts.direction, degrees = 180 / Math.PI;
        return { sky: parts.sky, sun: {
            azimuth: Math.atan2(east, north) * degrees,
            altitude: Math.atan2(up, Math.hypot(east, north)) * degrees,
            direct: of.channels === 3 ? parts.light : parts.light[0],
        } };
    }

    /** The sky and its sun apart, of the scene that is open. Null: no sun shines. */
    parts(lighting: Lighting, of: Description): SunParts | null {
        if (of !== this.open || lighting.solo !== null) return null;
        return this.source.parts(lighting.sky, this.isPhotometric, of.channels);
    }

    /** Fetches what a scene that is opened needs, without which it can still be shown. The function that it returns
     * takes that in; of the scene's default lighting it makes the one by the weather beside the store. */
    async prepare(description: Description): Promise<(lighting: Lighting) => Lighting> {
        const { answer, weather, reason } = await this.fetch(description);
        return (lighting) => {
            const { source } = this;
            this.open = description;
            source.take(answer);
            if (reason !== null) this.fail(reason);
            source.forget();
            if (weather !== null) source.read(weather, true);
            if (source.weather === null) return lighting;
            const { latitude, longitude, zone } = source.weather;
            const sky: SkyLight = { ...lighting.sky, model: "perez", latitude, longitude, zone };
            return { ...lighting, sky };
        };
    }

    /** Fetches what a scene that is compared needs. */
    async prepareOther({ name, sky }: Description): Promise<void> {
        if (sky !== null) this.source.takeOther(name, await this.api.sky(name));
    }

    private async fetch({ name, sky }: Description): Promise<Fetched> {
        if (sky === null) return { answer: null, weather: null, reason: null };
        try {
            const answer = await this.api.sky(name);
            return { answer, weather: answer.weather === null ? null : await this.api.weather(name), reason: null };
        } catch (reason) {
            return { answer: null, weather: null, reason };
        }
    }
}

interface Fetched {
    answer: SkyAnswer | null;
    weather: string | null;
    reason: unknown;
}
