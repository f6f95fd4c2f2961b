// What a program in TypeScript may write with Lambert's client, and may not: it is compiled, never run.
import { connect, LambertError, Newest, open, type Answer, type Emission } from "./lambert.js";

const scene = await open("http://127.0.0.1:8317/office", { token: "secret", check: 1 });
const lamps: Emission = { lamp: 17, lights: [1, 2, 3], ceiling: "3600lm" }, dimmers: Emission = { luminaires: { row: 1 } };
const sky: Emission = { sky: new Float32Array(145), groups: { lamp: "3lm" } };
const B: Answer = await scene.radiosity(lamps, { select: { groups: "floor" }, format: "f2", signal: new AbortController().signal });
await scene.radiosity([dimmers, new Float32Array(3), lamps, B]);
await scene.irradiance(B, { unit: "lx" });
await scene.radiosity(sky, { variant: "red", at: "faces" });
await scene.radiosity([[1, 2], [3, 4]]);
const { groups, reflectance } = await scene.adjoint({ groups: { floor: { mean: 1 } } }, { gradient: ["groups", "reflectance"], emission: lamps });
const dimming: Float32Array | Float64Array = (await scene.adjoint({ sensors: { desks: 1 } }, { gradient: "luminaires" })).values;
const { area, face } = await scene.elements(["area", "face"]), total: number = area.reduce((sum, m2) => sum + m2, 0);
const made = await scene.skies({ name: "overcast", lux_outside: 100 }), list = await scene.skies(["overcast"]);
const newest = new Newest((dim: number) => scene.radiosity({ lamp: dim }), ({ values }) => console.log(values.length), console.error);
newest.want(3);
console.log(groups.shape, reflectance.rows(), dimming, face, total, made.sky, list[0].unit, (await scene.groups()).get("floor")?.indices);
try {
    const { figures } = await scene.reduce(lamps, { groups: "floor", figures: ["mean", "share"], atLeast: 300 });
    console.log(figures.floor.mean, await connect("http://127.0.0.1:8317").sun({ latitude: 0, longitude: 0, zone: 0 }, [12], { year: 2026 }));
} catch (error) {
    if (error instanceof LambertError && error.status === 422) console.log(error.pointer, error.kind);
}
// @ts-expect-error: there is no such precision
await scene.radiosity(lamps, { format: "f3" });
// @ts-expect-error: figures are of groups or of sensors
await scene.reduce(lamps);
// @ts-expect-error: only what was named is there
console.log((await scene.elements("area")).normal);
// @ts-expect-error: a list of gradients has an answer for each name
console.log((await scene.adjoint(lamps, { gradient: ["groups"] })).values);
