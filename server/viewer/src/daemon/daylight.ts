// Answers of the daemon about the sky, the sun and the weather. Angles are degrees, azimuths run from north by east.

/** Where the tiles of a store's sky are; arrays have a member a tile. */
export interface SkyTiles {
    tiling: string;
    tiles: number;
    ground_albedo: number;
    centre: [number, number][];
    azimuth: [number, number][];
    altitude: [number, number][];
    solid_angle: number[];
    cosine: number[];
    weather: "epw" | "wea" | null;
}

/** A sky as POST …/skies takes it. */
export type SkyRequest = { [member: string]: unknown };

/** The sky that is answered, in W/m² or lx. */
export interface SkyMade {
    /** Radiance of each tile. */
    sky: number[];
    diffuse: number;
    direct: number;
    clearness: number | null;
    brightness: number | null;
    sun: {
        azimuth: number;
        altitude: number;
        /** In the axes of the store. */
        direction: [number, number, number];
        normal: number;
        /** The tiles that have its light, and the radiance that it adds to each. */
        tiles: number[];
        radiance: number[];
    } | null;
    /** Degrees from the north of the model's axes to its own. */
    north: number;
}

export interface Place {
    latitude: number;
    longitude: number;
    zone: number;
}

/** Positions at hours. */
export interface SunPositions {
    azimuth: number[];
    altitude: number[];
}

/** What becomes of rows and values by day that are missing. */
export type Gaps = "refuse" | "fill" | "skip";

/** A weather file, by columns; one of the two of direct light is there. */
export interface WeatherRows extends Place {
    place: string;
    step: number;
    year: number[];
    month: number[];
    day: number[];
    hour: number[];
    direct?: number[];
    direct_horizontal?: number[];
    diffuse: number[];
    dew_point: (number | null)[];
}
