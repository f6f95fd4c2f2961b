// The sky of the scene that is open, by the daemon, from the weather beside its store or a file that was picked, and
// those of scenes that it is compared with.
import { isProblem, type Api, type Description } from "../daemon/api.ts";
import type { Gaps, SkyTiles, WeatherRows } from "../daemon/daylight.ts";
import type { ExactSun } from "../state/request.ts";
import { isSolo, type Lighting, type SkyLight } from "../state/state.ts";
import type { Store } from "../state/store.ts";
import { placeOf } from "./sky_request.ts";
import type { Radiances, Sky, SunParts } from "./made_sky.ts";
import { SkySource } from "./source.ts";

/** What the sky of a lighting adds to an emission. */
export interface SkyShare {
    /** With the sun in tiles; without it where that is itself. */
    sky: Radiances | null;
    sun: ExactSun | null;
}

const BESIDE = "The file beside the store";

const NOTHING: SkyShare = { sky: null, sun: null };

type Asked = Pick<Api, "sky" | "makeSky" | "readWeather" | "weatherBeside">;

export class SceneSky {
    readonly source: SkySource;
    /** What the tiles are of: another scene may be shown before its own have come. */
    private open: Description | null = null;

    constructor(private readonly api: Asked, private readonly store: Store,
        private readonly fail: (reason: unknown) => void)
    {
        this.source = new SkySource(api);
    }

    get isPhotometric(): boolean {
        return this.store.now.view.unit === "lx";
    }

    /** What the sky of a lighting is made by: another one is another sky. */
    keyOf(lighting: Lighting, of: Description): string {
        if (!this.isLit(lighting, of)) return "";
        const { strength, factor, sun, tinted } = lighting.sky;
        return JSON.stringify([this.source.request(lighting.sky, this.isPhotometric), strength, factor, sun, tinted]);
    }

    /** What a scene's sky adds to the emission, where it is known; undefined: it is to be asked for. */
    known(lighting: Lighting, of: Description): SkyShare | undefined {
        const sky = this.knownSky(lighting, of);
        return sky === undefined ? undefined : shareOf(sky, lighting, of);
    }

    /** The same, asked for where it has to be. */
    async ask(lighting: Lighting, of: Description): Promise<SkyShare> {
        return shareOf(await this.askSky(lighting, of), lighting, of);
    }

    /** Radiances of the tiles of a scene; null: it has no sky, or that is not known. */
    radiances(lighting: Lighting, of: Description): Radiances | null {
        return this.knownSky(lighting, of)?.radiances(of.channels) ?? null;
    }

    /** The sky and its sun apart, of the scene that is open, as radiances. Null: no sun shines, or it is not known. */
    parts(lighting: Lighting, of: Description): SunParts | null {
        return of !== this.open ? null : this.knownSky(lighting, of)?.parts(of.channels) ?? null;
    }

    /** Null: no sky shines. */
    knownSky(lighting: Lighting, of: Description): Sky | null | undefined {
        return this.isLit(lighting, of) ? this.source.known(of.name, lighting.sky, this.isPhotometric) : null;
    }

    async askSky(lighting: Lighting, of: Description): Promise<Sky | null> {
        return this.isLit(lighting, of) ? this.source.sky(of.name, lighting.sky, this.isPhotometric) : null;
    }

    /** Reads a weather file, or that beside the store (null); one that is wrong is not taken, and `problem` says why.
     * True if it is taken. */
    async read(file: File | null, gaps: Gaps): Promise<boolean> {
        const { api, source, open } = this;
        if (open === null) return false;
        try {
            const rows = file === null
                ? await api.weatherBeside(open.name, gaps)
                : await api.readWeather(await file.text(), gaps);
            // A link cannot restore what was mended.
            if (open === this.open) source.takeWeather(rows, file === null && gaps === "refuse");
            return open === this.open;
        } catch (reason) {
            if (!isProblem(reason) || reason.status !== 422) throw reason;
            source.problem = `${file === null ? BESIDE : file.name} is not taken: ${reason.detail}.`;
            return false;
        }
    }

    /** Fetches what a scene that is opened needs, without which it can still be shown. The function that it returns
     * takes that in; of the scene's default lighting it makes the one by the weather beside the store. */
    async prepare(description: Description): Promise<(lighting: Lighting) => Lighting> {
        const { answer, weather, problem, reason } = await this.fetch(description);
        return (lighting) => {
            const { source } = this;
            this.open = description;
            source.take(answer);
            if (reason !== null) this.fail(reason);
            source.forget();
            source.problem = problem;
            if (weather === null) return lighting;
            source.takeWeather(weather, true);
            const sky: SkyLight = { ...lighting.sky, model: "perez", ...placeOf(weather) };
            return { ...lighting, sky };
        };
    }

    /** Makes sure that a scene that is compared has tiles. */
    async prepareOther({ name, sky }: Description): Promise<void> {
        if (sky === null) return;
        await this.api.sky(name);
        this.source.takeOther(name);
    }

    private isLit(lighting: Lighting, of: Description): boolean {
        const { source } = this, hasTiles = of === this.open ? source.tiles !== null : source.knows(of.name);
        return of.sky !== null && !isSolo(lighting) && hasTiles;
    }

    private async fetch({ name, sky }: Description): Promise<Fetched> {
        const fetched: Fetched = { answer: null, weather: null, problem: null, reason: null };
        if (sky === null) return fetched;
        try {
            fetched.answer = await this.api.sky(name);
            if (fetched.answer.weather !== null) fetched.weather = await this.api.weatherBeside(name, "refuse");
        } catch (reason) {
            if (fetched.answer !== null && isProblem(reason) && reason.status === 422)
                fetched.problem = `${BESIDE} is not taken: ${reason.detail}.`;
            else fetched.reason = reason;
        }
        return fetched;
    }
}

interface Fetched {
    answer: SkyTiles | null;
    weather: WeatherRows | null;
    problem: string | null;
    reason: unknown;
}

/** The sun is itself where the lighting wants that of the daemon and a scene has it: a store of few emitters answers
 * the sun by its tile alone. */
function shareOf(sky: Sky | null, lighting: Lighting, of: Description): SkyShare {
    if (sky === null) return NOTHING;
    const hasSun = lighting.sky.sun === "exact" && (of.emitters?.length ?? 0) === 0;
    return (hasSun ? sky.exact(of.channels) : null) ?? { sky: sky.radiances(of.channels), sun: null };
}
