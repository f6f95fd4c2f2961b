// Made from server/route/openapi.json by types.mjs: do not edit.
export interface components {
    schemas: {
        /** @description RFC 9457. */
        Problem: {
            /**
             * Format: uri-reference
             * @description The class of the problem: the section of the manual that explains it, relative to the path of the request; the daemon serves it there.
             */
            type: "deploy/docs/api.md#malformed-head" | "deploy/docs/api.md#not-json" | "deploy/docs/api.md#not-npy" | "deploy/docs/api.md#no-token" | "deploy/docs/api.md#no-right" | "deploy/docs/api.md#not-allowed" | "deploy/docs/api.md#wrong-host" | "deploy/docs/api.md#wrong-origin" | "deploy/docs/api.md#not-found" | "deploy/docs/api.md#wrong-method" | "deploy/docs/api.md#conflict" | "deploy/docs/api.md#too-long" | "deploy/docs/api.md#media-type" | "deploy/docs/api.md#wrong-kind" | "deploy/docs/api.md#wrong-members" | "deploy/docs/api.md#wrong-length" | "deploy/docs/api.md#bad-index" | "deploy/docs/api.md#bad-value" | "deploy/docs/api.md#unknown-group" | "deploy/docs/api.md#unknown-word" | "deploy/docs/api.md#given-twice" | "deploy/docs/api.md#too-much" | "deploy/docs/api.md#not-in-store" | "deploy/docs/api.md#not-in-encoding" | "deploy/docs/api.md#not-refined" | "deploy/docs/api.md#too-many-variants" | "deploy/docs/api.md#internal" | "deploy/docs/api.md#transfer-coding" | "deploy/docs/api.md#no-memory" | "deploy/docs/api.md#unavailable";
            title: string;
            status: number;
            detail: string;
            /** @description JSON pointer to the member at fault. */
            pointer?: string;
        };
        /** @description Stores that were refused when stores were read last, where there are any. */
        Refused: {
            /** @description The name that its scene would have. */
            name: string;
            reason: string;
            /** @description True where the scene that was read from it before is served on. */
            kept: boolean;
        }[];
        SceneLine: {
            name: string;
            elements: number;
            channels: number;
            kind: components["schemas"]["Kind"];
            /** @description Bytes of the operator as stored. */
            bytes: number;
        };
        /** @description The kind of the operator, one of those in store/FORMAT.md, such as low_rank. */
        Kind: string;
        Vector3: number[];
        /** @description Has `rank` or `density`, by kind. */
        Scene: {
            name: string;
            elements: number;
            /** @description Faces of the scene file, in the order of which an answer `at` faces is; null where the store does not know them. */
            faces?: number | null;
            channels: number;
            /**
             * @description What emissions without a unit are, and answers that ask for none: W/m² (radiances W/(m² sr)), or lm/m² and lx (cd/m²).
             */
            lights: "W" | "lm";
            kind: components["schemas"]["Kind"];
            method?: string | null;
            /** @description The reason why this method was chosen. */
            reason?: string | null;
            epsilon?: number | null;
            precision?: string | null;
            rank?: number;
            density?: number;
            /** @description m^2 that faces of the scene cover more than once in one plane; absent where none do. The stated errors contain it. */
            overlap_area?: number;
            /** @description The figures that the method reported when it built the operator, by name. */
            report?: {
                [key: string]: number | string | null;
            };
            /** @description Bytes of the operator as stored. */
            bytes: number;
            /** @description Names of the emitters; null if the store answers any emission. */
            emitters?: string[] | null;
            /** @description The perspective cameras that came with the scene, in the axes of the store (y up for a glTF, unless --up says otherwise), not in those of its mesh as glTF. */
            cameras?: {
                name: string;
                /** @description Metres. */
                eye: components["schemas"]["Vector3"];
                /** @description Unit vector along which it looks. */
                direction: components["schemas"]["Vector3"];
                /** @description Unit vector at right angles to `direction`, upwards in the picture. */
                up: components["schemas"]["Vector3"];
                /** @description Vertical field of view, degrees. */
                fov: number;
            }[];
            sky?: {
                tiling?: string | null;
                tiles?: number;
                ground_albedo?: number | null;
                /** @description Degrees by which the sun is turned, where it is not 0. */
                north?: number;
            } | null;
            /** @description null where the store has none. */
            luminaires?: {
                count?: number;
                /** @description Of all at dimmer 1. */
                lumens?: number;
            } | null;
            /** @description null where the store has none. */
            sensors?: {
                sets?: number;
                receivers?: number;
            } | null;
            /** @description The elements that the store was built to be read at; null for all. Elsewhere its answers are only roughly right. */
            importance?: {
                option?: string;
                elements?: number;
            } | null;
            /** @description The elements that alone emit in what the store was built for; null for any emission. Answers to others are only roughly right. All figures of `error` are of emissions of these elements. */
            sources?: {
                option?: string;
                elements?: number;
            } | null;
            /** @description Program, time and input of the store. */
            provenance?: Record<string, never>;
            /** @description Those of the backs of faces with two sides, NAME.back, are the last. */
            groups: {
                name: string;
                elements: number;
                /** @description Those of the elements that lie below a body that stands on them, which figures leave out; absent where there are none. */
                buried?: {
                    elements: number;
                    /** @description m^2 */
                    area: number;
                };
                /** @description The group is a pane, which light passes; absent of other groups. */
                glass?: {
                    /** @description The part of light that passes at normal incidence, of all faces that a ray crosses together. */
                    transmittance: number;
                    /** @description Faces of the pane that a ray crosses one behind the other. */
                    faces: number;
                };
            }[];
            /**
             * @description With panes: of light at the angle t to the normal, a pane passes its part times min(1, 1.018 cos t (1 + sin^3 t)), or, with none, its part at any angle. Absent without panes.
             */
            glass_law?: "angle" | "none";
            /** @description `stated`, the one figure of operator, form factors and mesh for the scene's own lights, else for skies, else for random emission (`light`), with `parts`, and above .1 with `coarse` and `advice`, as in answers. By kind of emission (single, lights, random, whole: one group, sky), and of the mesh (mesh: `lights` and `even`, the share of reflected light that values constant on elements leave): figures such as `total_indirect_mean`, and of a store that was built for receivers (`importance`) those of their light, `receivers_relative` and `receivers_indirect`. `by_group`: at most 32 groups of the scene, those first whose means have the largest error by uniform light, with `uniform`, `near`, `far` and the largest of each over the probes. */
            error?: {
                [key: string]: unknown;
            };
        };
        /** @description A number for all channels, or one for each. */
        PerChannel: number | number[];
        /** @description A number for each element, every channel alike; or such a row for each channel. */
        Vector: number[] | number[][];
        /** @description A light with its unit, such as `3600lm`, `40W` (the flux of all that the name means together, spread evenly over its area), `500cd/m2` (a luminance), `100lm/m2` or `12W/m2` (exitances); one number, or one for each channel between commas, before the unit. W and lm become each other by 179 lm/W, which the answer says (`converted_by`). */
        LightText: string;
        Emission: components["schemas"]["Vector"] | {
            elements?: number[];
            values?: components["schemas"]["PerChannel"][];
            groups?: {
                [key: string]: components["schemas"]["PerChannel"] | components["schemas"]["LightText"];
            };
            sky?: components["schemas"]["PerChannel"][];
            sun?: {
                /** @description degrees from north by east */
                azimuth: number;
                /** @description degrees; at 0 and below the sun gives no light */
                altitude: number;
                /** @description irradiance of a plane that faces the sun */
                direct: components["schemas"]["PerChannel"];
                /** @description degrees, of the model; the store's own unless it is given */
                north?: number;
            };
            emitters?: components["schemas"]["PerChannel"][] | {
                [key: string]: components["schemas"]["PerChannel"];
            };
            luminaires?: {
                [key: string]: components["schemas"]["PerChannel"];
            };
        };
        Select: {
            elements: number[];
        } | {
            groups: string[];
        } | {
            faces: number[];
        } | components["schemas"]["SensorSets"] | {
            /** @description Names of sets of probes, as of sensors. */
            probes: string[];
        };
        SensorSets: {
            /** @description Names of sets; of a beginning all NAME.something, of NAME* all whose names begin so. */
            sensors: string[];
        };
        Quantity: "radiosity" | "irradiance" | "indirect";
        Statistic: "mean" | "sum" | "min" | "max" | "uniformity" | "variance" | "share" | "ugr";
        /** @description UGR of an eye (CIE 117) by luminaires alone, as `lambert solve --sensors` has it. Of a batch without `luminaires`. */
        EyeRating: {
            ugr: number | null;
            /** @description cd/m²: all light at the eye but that of luminaires directly, over π; null where the eye has no value, or the answer is not in lx. */
            background: number | null;
            /** @description The reason of a `ugr` that is null; else absent. */
            why?: string;
            /** @description The luminaires that count, the largest first. */
            luminaires?: {
                name: string;
                /** @description Of the sum over luminaires. */
                part: number;
                /** @description cd/m² */
                luminance: number;
                /** @description sr, of the part that is seen. */
                solid_angle: number;
                /** @description The index of Guth. */
                position: number;
                /** @description The share of the opening that is seen. */
                seen: number;
            }[];
        };
        RadiosityRequest: {
            emission?: components["schemas"]["Emission"];
            emissions?: components["schemas"]["Emission"][];
            select?: components["schemas"]["Select"];
            /**
             * @description `corners`: light at the corners that elements share, which vertices of `mesh?corners` are: value v belongs to vertex v. Without `select`, `reduce` and `tolerance`; `error` is that of the elements. `faces`: means by area over the elements of each face of the scene file, in its order, of fronts alone; null (NPY: NaN) for a face without an element. `select` is then of groups, whose faces are meant, or of faces, which alone ask for it. Not with `reduce`.
             * @default elements
             */
            at?: "elements" | "faces" | "corners";
            /** @default radiosity */
            quantity?: components["schemas"]["Quantity"];
            /**
             * @description Unit of the answer, of irradiance; of radiosity and indirect light the same per area that they leave (lm/m2, klm/m2, lm/ft2). Absent: that of the light, by `lights` of the scene and `photometric`. Three channels become one, their luminance, in all but W/m2.
             */
            unit?: "lx" | "klx" | "fc" | "W/m2";
            /** @description The radiances of `sky` are in cd/m² (true) or W/(m² sr) (false); absent: as `lights` of the scene says. Beside light of the other kind the answer is photometric. */
            photometric?: boolean;
            /** @description Refines the answer until the certified |B − B~|∞ ≤ tolerance · |B~ − E|∞. */
            tolerance?: number;
            /**
             * @description False gives the plain linear map. Else no light is below zero where no emission is: what is below is raised to zero, and the means of groups are kept.
             * @default true
             */
            limit?: boolean;
            /** @description Statistics of groups in place of the vector, weighted by area, or of sets of sensors, of which each counts alike and those without a value do not. With `tolerance` they are those of the refined values, whose certificate is given. */
            reduce?: {
                groups?: string[];
                sensors?: string[];
                /** @description `sum` is of groups alone, `ugr` of sensors whose sets have the kind eyes. */
                with: components["schemas"]["Statistic"][];
                /** @description Of `share`, in the unit of the answer: the part of the area, or of the sensors, that has so much. */
                at_least?: number[];
            } & (unknown | unknown);
        } & (unknown | unknown);
        /** @description null stands for a face without an element, in an answer `at` faces, and for a sensor without a value, `at` sensors, alone. */
        Light: (number | null)[] | (number | null)[][] | (number | null)[][][];
        RadiosityAnswer: {
            scene: string;
            elements: number;
            channels: number;
            /**
             * @description `radiance` of probes alone, nine coefficients each.
             */
            quantity: "radiosity" | "irradiance" | "indirect" | "radiance";
            /**
             * @description Of the values; sums over groups are in it times m², variances in its square.
             */
            unit: "W/m2" | "lx" | "klx" | "fc" | "lm/m2" | "klm/m2" | "lm/ft2" | "cd/m2" | "W/(m2 sr)";
            /** @description The factors and weights by which lights or values were converted, such as `179 lm/W; luminance 0.2126 R + 0.7152 G + 0.0722 B`; absent where none was. */
            converted_by?: string;
            /**
             * @description The values are of faces of the scene file, of corners that elements share, of sensors or of probes; absent where they are of elements.
             */
            at?: "faces" | "corners" | "sensors" | "probes";
            radiance?: components["schemas"]["Light"];
            radiosity?: components["schemas"]["Light"];
            irradiance?: components["schemas"]["Light"];
            indirect?: components["schemas"]["Light"];
            /** @description Answer to `reduce`. */
            groups?: {
                [key: string]: {
                    [key: string]: unknown;
                };
            };
            /** @description Answer to `reduce` of sensors. `share` holds a figure for each limit of `at_least`. */
            sensors?: {
                [key: string]: {
                    /** @description A rating for each eye; of a batch an array of these for each vector. */
                    ugr?: (components["schemas"]["EyeRating"] | components["schemas"]["EyeRating"][])[];
                } & {
                    [key: string]: unknown;
                };
            };
            /**
             * @description Of a store of one channel that was asked for a coloured sky: it is lit by the luminance of that.
             */
            sky?: "luminance";
            error?: {
                /** @description The one figure to look at: the root of the sum of squares of operator, form factors and mesh for this light and what was selected (with `reduce` of the mean of the worst group, of a batch of the worst vector), as a share of the light that surfaces reflect, |B - E|, of irradiance of |H|. null where nothing was measured. */
                stated?: number | null;
                /** @description true where `stated` is above .1; else absent. */
                coarse?: boolean;
                /** @description Of a coarse error the option of `lambert precompute` that lowers it; of one that is null how it can be measured. */
                advice?: string;
                /** @description Parts of `stated`, whose squares add up: `operator`, `form_factors` and `mesh`, where that was measured; of a light in many positions `walks`. */
                parts?: {
                    [key: string]: number | null;
                };
                /** @description Error over the radiosity, of irradiance over the irradiance; null where that is 0, or no larger than the error. With `reduce` of the mean of the worst group, of a batch of the worst vector. */
                relative_mean?: number | null;
                /** @description The same over the reflected light, of irradiance over that without the direct light of sky, sun and luminaires. */
                indirect_mean?: number | null;
                /**
                 * @description The light that these figures are of: own: the emission, sky, sun and luminaires of this request; lights: those of the scene, or single: single elements, whatever was asked for (stores without errors by group).
                 */
                light?: "own" | "lights" | "single";
                /** @description Effective number of emitters of `own`, P^2 / sum A^2 E^2 with P = sum A E; of a sky of its tiles, weighted by the light that they send into the scene. */
                emitters?: number;
                /** @description With `reduce`, of each group: the error of its mean, and the root of the mean square error of its elements, both over its mean reflected light, without the mesh; and `stated`, that of its mean with the mesh. */
                groups?: {
                    [key: string]: {
                        mean?: number | null;
                        elements?: number | null;
                        stated?: number | null;
                    };
                };
                /** @description Of an answer at sensors, of the sensors of each name: the root of the mean square error over that of their values. */
                sensors?: {
                    [key: string]: {
                        stated?: number | null;
                    };
                };
                /** @description The share of the light that values constant on elements leave, for this light, by group; the same as in `parts`. Only a finer mesh lowers it. Absent where the store does not state it, or it is 0. */
                mesh?: number;
                /**
                 * @description The elements that these figures are of; of stores alone that were built for receivers (`importance`). An answer of nothing but receivers has the figures of their light, any other those of all elements.
                 */
                of?: "receivers" | "all";
                /**
                 * @description The elements that emit; of stores alone that were built for sources (`sources`). Where others than these emit, or a sky or luminaires light the scene, no figures are stated, and `stated` is null.
                 */
                from?: "sources" | "others";
            };
            /** @description Elements that the linear map put below zero, in all channels: of all elements, of those reduced, or of all in the groups of those selected. One for each vector of a batch. Absent with `limit` false, with `tolerance`, and of means and sums alone. */
            limited?: number | number[];
            /** @description Answer to `tolerance`. */
            certificate?: number;
            iterations?: number;
            time_ms: {
                parse: number;
                solve: number;
                encode: number;
            };
        };
        AdjointRequest: {
            cotangent?: components["schemas"]["Cotangent"];
            /** @description A batch, in place of cotangent: gradients are one level deeper. */
            cotangents?: components["schemas"]["Cotangent"][];
            /** @default radiosity */
            quantity?: components["schemas"]["Quantity"];
            gradient?: ("emission" | "reflectance" | "sky" | "emitters" | "groups" | "luminaires")[];
            emission?: components["schemas"]["Emission"];
        } & (unknown | unknown);
        Cotangent: components["schemas"]["Vector"] | {
            /** @description By the names of groups: a weight of the mean of a group by area, or of its sum, the integral over its area. */
            groups: {
                [key: string]: {
                    mean?: components["schemas"]["PerChannel"];
                    sum?: components["schemas"]["PerChannel"];
                };
            };
        } | {
            /** @description By the names of sets: a weight of the value of each sensor, or `values`, one each (for each channel). J is then of irradiances. */
            sensors: {
                [key: string]: components["schemas"]["PerChannel"] | {
                    values: unknown[];
                };
            };
        };
        AdjointAnswer: {
            /**
             * @description The cotangent is of sensors; else absent.
             */
            at?: "sensors";
            /** @description As in answers of radiosity, of the lights of `emission`. */
            converted_by?: string;
            /**
             * @description Of a store of one channel, whose `emission` has a coloured sky: it is lit by the luminance of that.
             */
            sky?: "luminance";
            gradient: {
                emission?: components["schemas"]["Vector"];
                reflectance?: components["schemas"]["Vector"];
                sky?: components["schemas"]["PerChannel"][];
                emitters?: components["schemas"]["PerChannel"][];
                /** @description By one emission that all elements of a group have, in the order of the scene's `groups`: [g], or [C][g] for more than one channel. */
                groups?: components["schemas"]["PerChannel"][];
                /** @description By the dimmer of each luminaire, in their order: [k], or [C][k] for more than one channel. */
                luminaires?: components["schemas"]["PerChannel"][];
            };
        };
        SkiesRequest: {
            sky?: components["schemas"]["SkyWanted"];
            skies?: components["schemas"]["SkyWanted"][];
        } & (unknown | unknown);
        /** @description A name, or an object with one of `name`, `diffuse` and `weather`. */
        SkyWanted: string | {
            /** @description `even`, `overcast`, `clear`, or `turbidity:T` with Linke's T from 1 to 20. */
            name?: string;
            /** @description Diffuse light on a horizontal plane, W/m², spread by the sky of Perez et al. 1993. */
            diffuse?: number;
            /** @description Beside `diffuse`: direct light normal to the sun, W/m². */
            direct?: number;
            /** @description In place of `direct`: direct light on a horizontal plane, W/m². Normal to the sun it is at most the extraterrestrial irradiance. */
            direct_horizontal?: number;
            /** @description Beside `diffuse`: degrees Celsius, for the luminous efficacy. */
            dew_point?: number;
            /**
             * @description The row of the weather beside the store that covers `date` or `hour`, with the sun in its middle.
             * @constant
             */
            weather?: true;
            /**
             * @description Beside `weather`, as `--gaps`.
             * @default refuse
             */
            gaps?: "refuse" | "fill" | "skip";
            sun?: {
                /** @description Degrees from north by east. */
                azimuth: number;
                altitude: number;
            };
            /** @description North and east are positive; `zone` is hours ahead of UTC. With it `date` or `hour`. */
            place?: {
                latitude: number;
                longitude: number;
                zone: number;
            };
            /**
             * @description Standard time.
             * @example 21 Mar 12:00
             */
            date?: string;
            /** @description From the beginning of a year of 365 days. */
            hour?: number;
            /**
             * @description Beside `place`: the year of the sun's position.
             * @default 2001
             */
            year?: number;
            /** @description Where north is in the model, degrees from +y (z up) or -z (y up) by east. */
            north?: number;
            /** @description Illuminance of a horizontal plane by sky and sun. */
            lux_outside?: number;
            /** @description In cd/m² and lx; absent: as `lights` of the scene says. */
            photometric?: boolean;
            /**
             * @description The tile that holds the sun has its direct light.
             * @default true
             */
            sun_in_tiles?: boolean;
            /**
             * @description The direct light is that of the tiles near the sun, by their distance, so that a sun that moves brightens none in a step.
             * @default false
             */
            sun_spread?: boolean;
            /**
             * @description A sky without light is answered with radiances of 0, not refused.
             * @default false
             */
            dark?: boolean;
        };
        SkiesAnswer: {
            scene: string;
            tiles: number;
            skies: {
                /** @description Radiance of each tile, W/(m² sr), or cd/m² where the unit is lx. */
                sky: number[];
                unit: "W/m2" | "lx";
                /** @description Of a horizontal plane, by the sky. */
                diffuse: number;
                /** @description Of a horizontal plane, by the sun. */
                direct: number;
                /** @description ε of Perez et al. 1993; null: the sky has another distribution, or no diffuse light. */
                clearness: number | null;
                /** @description Δ of Perez et al. 1993, .01 to .6; null: the sky has another distribution. */
                brightness: number | null;
                /** @description Degrees by which the sun, and the sky with it, was turned: that of the request, or of the store. */
                north: number;
                /** @description null: the sky has none. */
                sun: null | {
                    /** @description Degrees from north by east. */
                    azimuth: number;
                    altitude: number;
                    /** @description Towards the sun, a unit vector in the axes of the scene file. */
                    direction: number[];
                    /** @description Direct light normal to the sun, in the unit. */
                    normal: number;
                    /** @description The tiles that have its light, where `sun_in_tiles` is true in `sky` too. */
                    tiles: number[];
                    /** @description The radiance that its light adds to each of these. */
                    radiance: number[];
                };
            }[];
        };
        SunRequest: {
            /** @description North and east are positive; `zone` is hours ahead of UTC. */
            place: {
                latitude: number;
                longitude: number;
                zone: number;
            };
            /** @description Standard time, from the beginning of a year of 365 days. */
            hours: number[];
            /** @default 2001 */
            year?: number;
        };
        SunAnswer: {
            /** @description Degrees from north by east, -180 to 180, for each hour. */
            azimuth: number[];
            /** @description Degrees above the horizon; below 0 it is night. */
            altitude: number[];
        };
        WeatherRequest: {
            /** @description The whole file, at most 16 MiB: an EPW begins with LOCATION, a WEA with place. */
            text: string;
            /**
             * @description Rows and values by day that are missing, as `--gaps`.
             * @default refuse
             */
            gaps?: "refuse" | "fill" | "skip";
        };
        WeatherBesideRequest: {
            /**
             * @description Rows and values by day that are missing, as `--gaps`.
             * @default refuse
             */
            gaps?: "refuse" | "fill" | "skip";
        };
        /** @description Columns have a member for each row. */
        Weather: {
            format: "epw" | "wea";
            place: string;
            /** @description Degrees, north positive. */
            latitude: number;
            /** @description Degrees, east positive. */
            longitude: number;
            /** @description Hours that standard time is ahead of UTC. */
            zone: number;
            /** @description m. */
            elevation: number;
            /** @description Hours that each row stands for. */
            step: number;
            rows: number;
            /** @description Changes to the file. */
            mended: {
                /** @description Missing values of radiation by night, which count as 0. */
                night?: number;
                /** @description Values from -10 to 0 W/m², which count as 0. */
                below?: number;
                /** @description Rows whose dew point is missing. */
                no_dew_point?: number;
                /** @description Rows that were dropped. */
                repeated?: number;
                /** @description Rows that were put in order. */
                unordered?: number;
                /** @description Hours of light that was taken from rows around a gap, or from other days. */
                filled?: number;
                /** @description Hours of rows that were added by night, without light. */
                dark?: number;
                /** @description Hours that were left out. */
                skipped?: number;
            };
            /** @description Month and day of each day, in the order of the rows. */
            days: number[][];
            /** @description Of a WEA 2001, or 2000 where it has a 29 February. */
            year: number[];
            /** @description 1 to 12. */
            month: number[];
            /** @description Of the month. */
            day: number[];
            /** @description Standard time: the middle of what the row covers. */
            hour: number[];
            /** @description W/m², normal to the sun. */
            direct?: number[];
            /** @description In place of `direct`, where the file has that: W/m², on a horizontal plane. */
            direct_horizontal?: number[];
            /** @description W/m², on a horizontal plane. */
            diffuse: number[];
            /** @description Degrees Celsius; null: unknown. */
            dew_point: (number | null)[];
        } & (unknown | unknown);
        VariantRequest: {
            variant: string;
            groups: {
                [key: string]: components["schemas"]["PerChannel"];
            };
        };
        Building: {
            /** @constant */
            status: "building";
        };
        /** @description The members of fields that were not asked for are not there. */
        Elements: {
            scene: string;
            elements: number;
            channels: number;
            /** @constant */
            unit: "m";
            /** @description The names of groups, which `group` counts from 0. */
            groups: string[];
            /** @description m2. */
            area?: number[];
            /** @description Unit vectors towards the front. */
            normal?: (number | null)[][];
            /** @description Area centroids, m. */
            centre?: (number | null)[][];
            group?: number[];
            /** @description Faces of the scene file, counted from 0; null: none, several, or not known. */
            face?: (number | null)[];
            /** @description [n], of more channels [C][n]. */
            reflectance?: (number | number[])[];
        };
        Groups: {
            scene: string;
            elements: number;
            channels: number;
            /**
             * @description As in the description of the scene.
             */
            lights: "W" | "lm";
            units: {
                /** @constant */
                area: "m2";
                emission: "W/m2" | "lm/m2";
            };
            groups: {
                name: string;
                /** @description Of the elements that figures take in. */
                area: number;
                /** @description All of the group. */
                elements: number;
                /** @description [C], means by that area; null without area. */
                reflectance: (number | null)[];
                /** @description [C], means of the scene's own emission by that area; null without area. */
                emission: (number | null)[];
                /** @description Elements of the group that figures leave out. */
                buried: number;
            }[];
        };
        /** @description Arrays have a member for each tile, in the order in which radiances are sent. Angles are in degrees, azimuths from north by east. */
        Sky: {
            /** @description `tregenza`, `reinhart:MF` or `grid:AxB`. */
            tiling: string;
            tiles: number;
            up: "x" | "y" | "z";
            /** @description Unit vector in the axes of the scene file. */
            east: (-1 | 0 | 1)[];
            /** @description Unit vector in the axes of the scene file. */
            north: (-1 | 0 | 1)[];
            ground_albedo: number;
            /** @description Azimuth, from 0 to below 360, and altitude of the middle. */
            centre: number[][];
            /** @description From, to; the first tile of a band begins west of north, below 0. */
            azimuth: number[][];
            /** @description From, to. */
            altitude: number[][];
            /** @description sr; all together 2 pi. */
            solid_angle: number[];
            /** @description Integral of the cosine to the zenith, sr: radiance times this is the irradiance of a horizontal plane. */
            cosine: number[];
            /**
             * @description Format of what /v1/scenes/NAME/weather has; null: there is none.
             */
            weather: "epw" | "wea" | null;
        };
        Luminaires: {
            luminaires: {
                name: string;
                /** @description Those that are dimmed together by this name. */
                group: string | null;
                /** @description The middle of its opening, metres, in the axes of the store. */
                at: components["schemas"]["Vector3"];
                /** @description Unit vector along which it looks: gamma 0. */
                aim: components["schemas"]["Vector3"];
                /** @description Unit vector of the plane C0, at right angles to `aim`. */
                c0: components["schemas"]["Vector3"];
                /** @description The dimmer that its list gives it. An emission says its own. */
                dim: number;
                /** @description At dimmer 1. */
                lumens: number;
                /** @description Factors of red, green and blue, of luminance 1. */
                colour: components["schemas"]["Vector3"];
                opening: {
                    /** @description point, rectangle, box, disc, ellipse, upright cylinder, sphere, ellipsoid, cylinder along x, cylinder along y or upright disc. */
                    shape: string;
                    /** @description Metres along C0, C90 and up. */
                    size: components["schemas"]["Vector3"];
                };
            }[];
            groups: {
                name: string;
                luminaires: number;
                lumens: number;
            }[];
            /** @description Of all at dimmer 1. */
            lumens: number;
        };
        Sensors: {
            sets: {
                name: string;
                /** @description points, grids, eyes, cylinders, semicylinders, spheres, cubes or probes; a number of a later version. Eyes have a UGR. */
                kind: string | number;
                /** @description What directions count: plane (cosine), cylinder, semicylinder sphere or harmonics: harmonics, of probes, nine after each other. */
                weight: string | number;
                /** @description Of its sensors among those of the store. */
                first: number;
                count: number;
                /** @description Of a grid alone, as the next three. */
                rows?: number;
                columns?: number;
                /** @description Metres, of columns and of rows. */
                spacing?: number[];
                /** @description Row times columns plus column, of each sensor. */
                cells?: number[];
                /** @description Metres, in the axes of the store. */
                at: components["schemas"]["Vector3"][];
                /** @description Unit normal of planes, axis of cylinders: one where all share it, else one each; null of spheres. */
                axis: unknown[] | null;
                /** @description The way that semi-cylinders look; null of others. */
                look: unknown[] | null;
                /** @description Those of the set, from 0, most of whose rays meet backs of faces; they have no value. */
                in_walls: number[];
                /** @description Those in the opening of a luminaire; they have no value. */
                in_luminaires: number[];
            }[];
            sensors: number;
        };
        JacobianRequest: {
            /** @description One of these. Sensors have irradiances, groups their means by area and elements their values. */
            of: {
                sensors?: string[];
                groups?: string[];
                elements?: number[];
            };
            /**
             * @description Radiosity where it is absent; of sensors irradiance.
             */
            quantity?: "radiosity" | "irradiance" | "indirect";
            /** @description Dimmers of luminaires, emissions that all elements of a group have, radiances of tiles; of a store of few emitters the weights of these, of which luminaires are the last, in place of groups and tiles. Absent: all that the store has. */
            by?: ("luminaires" | "groups" | "sky" | "emitters")[];
        };
        JacobianAnswer: {
            scene: string;
            quantity: "radiosity" | "irradiance" | "indirect";
            /**
             * @description Absent of groups and elements.
             */
            at?: "sensors";
            /** @description The rows of each name of `of`, in order. */
            sensors?: {
                [key: string]: number;
            };
            /** @description The names of `of`, a row each. */
            groups?: string[];
            columns: {
                luminaires?: string[];
                groups?: string[];
                /** @description Tiles. */
                sky?: number;
                emitters?: string[];
            };
            /** @description [rows][columns], or [C][rows][columns] for more than one channel. */
            jacobian: {
                luminaires?: components["schemas"]["Light"];
                groups?: components["schemas"]["Light"];
                sky?: components["schemas"]["Light"];
                emitters?: components["schemas"]["Light"];
            };
        };
    };
    responses: never;
    parameters: never;
    requestBodies: never;
    headers: never;
    pathItems: never;
}
export type Problem = components['schemas']['Problem'];
export type Refused = components['schemas']['Refused'];
export type SceneLine = components['schemas']['SceneLine'];
export type Kind = components['schemas']['Kind'];
export type Vector3 = components['schemas']['Vector3'];
export type Scene = components['schemas']['Scene'];
export type PerChannel = components['schemas']['PerChannel'];
export type Vector = components['schemas']['Vector'];
export type LightText = components['schemas']['LightText'];
export type Emission = components['schemas']['Emission'];
export type Select = components['schemas']['Select'];
export type SensorSets = components['schemas']['SensorSets'];
export type Quantity = components['schemas']['Quantity'];
export type Statistic = components['schemas']['Statistic'];
export type EyeRating = components['schemas']['EyeRating'];
export type RadiosityRequest = components['schemas']['RadiosityRequest'];
export type Light = components['schemas']['Light'];
export type RadiosityAnswer = components['schemas']['RadiosityAnswer'];
export type AdjointRequest = components['schemas']['AdjointRequest'];
export type Cotangent = components['schemas']['Cotangent'];
export type AdjointAnswer = components['schemas']['AdjointAnswer'];
export type SkiesRequest = components['schemas']['SkiesRequest'];
export type SkyWanted = components['schemas']['SkyWanted'];
export type SkiesAnswer = components['schemas']['SkiesAnswer'];
export type SunRequest = components['schemas']['SunRequest'];
export type SunAnswer = components['schemas']['SunAnswer'];
export type WeatherRequest = components['schemas']['WeatherRequest'];
export type WeatherBesideRequest = components['schemas']['WeatherBesideRequest'];
export type Weather = components['schemas']['Weather'];
export type VariantRequest = components['schemas']['VariantRequest'];
export type Building = components['schemas']['Building'];
export type Elements = components['schemas']['Elements'];
export type Groups = components['schemas']['Groups'];
export type Sky = components['schemas']['Sky'];
export type Luminaires = components['schemas']['Luminaires'];
export type Sensors = components['schemas']['Sensors'];
export type JacobianRequest = components['schemas']['JacobianRequest'];
export type JacobianAnswer = components['schemas']['JacobianAnswer'];
