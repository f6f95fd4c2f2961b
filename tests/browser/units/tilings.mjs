// Tilings of the sky as GET /v1/scenes/NAME/sky answers them, made without a daemon.
const RADIANS = Math.PI / 180, TREGENZA = [30, 30, 24, 24, 18, 12, 6];

/** Bands from the horizon up, of so many tiles each; the first tile of each has north in its middle. */
function banded(tiling, counts, height) {
    const answer = { tiling, tiles: 0, ground_albedo: 0, centre: [], azimuth: [], altitude: [], solid_angle: [], cosine: [], weather: null };
    const add = (azimuth, altitude, centre) => {
        const [low, high] = altitude.map((angle) => Math.sin(angle * RADIANS)), width = (azimuth[1] - azimuth[0]) * RADIANS;
        answer.tiles += 1;
        answer.azimuth.push(azimuth);
        answer.altitude.push(altitude);
        answer.centre.push(centre);
        answer.solid_angle.push(width * (high - low));
        answer.cosine.push((width * (high ** 2 - low ** 2)) / 2);
    };
    counts.forEach((count, band) => {
        const width = 360 / count, low = band * height;
        for (let k = 0; k < count; k++) add([(k - 0.5) * width, (k + 0.5) * width], [low, low + height], [k * width, low + height / 2]);
    });
    const top = counts.length * height;
    if (top < 90 - 1e-9) add([-180, 180], [top, 90], [0, 90]);
    return answer;
}

export const tilings = {
    "reinhart:2": banded("reinhart:2", TREGENZA.flatMap((count) => [2 * count, 2 * count]), 90 / 14.5),
    tregenza: banded("tregenza", TREGENZA, 12),
    "grid:12x5": banded("grid:12x5", Array(5).fill(12), 18),
};
