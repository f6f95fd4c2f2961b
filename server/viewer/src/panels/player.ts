// Play, pause and speed. Who asks for less motion gets steps by hand alone.
import { button, choice, make } from "../base/dom.ts";

export interface PlayerOptions {
    /** The thing that goes on, for labels. */
    what: string;
    speeds: readonly (readonly [string, string])[];
    speed: string;
    /** Goes on by seconds times the speed, or by one step back or forth. */
    advance: (amount: number) => void;
    step: number;
    stepLabel: string;
}

export interface Player {
    element: HTMLElement;
    stop(): void;
}

/** Pictures a second at most: the daemon and the eye need no more. */
const FRAME_S = 1 / 30;

export function player(options: PlayerOptions): Player {
    let running = 0, last = 0, speed = Number(options.speed);
    const calm = matchMedia("(prefers-reduced-motion: reduce)");
    const play = button("▶ Play", `Play ${options.what}`, () => (running === 0 ? start() : stop()), {
        "aria-pressed": "false",
    });
    const show = (): void => {
        play.textContent = running === 0 ? "▶ Play" : "❚❚ Pause";
        play.setAttribute("aria-pressed", String(running !== 0));
        play.setAttribute("aria-label", running === 0 ? `Play ${options.what}` : `Pause ${options.what}`);
    };
    const tick = (time: number): void => {
        running = requestAnimationFrame(tick);
        const seconds = (time - last) / 1000;
        if (seconds < FRAME_S) return;
        last = time;
        // A page that was hidden does not make up for it.
        options.advance(Math.min(seconds, 0.25) * speed);
    };
    const start = (): void => {
        last = performance.now();
        running = requestAnimationFrame(tick);
        show();
    };
    const stop = (): void => {
        cancelAnimationFrame(running);
        running = 0;
        show();
    };
    const pace = choice("Speed", options.speeds, options.speed, (value) => {
        speed = Number(value);
    });
    const setMotion = (): void => {
        if (calm.matches) stop();
        play.hidden = calm.matches;
        pace.hidden = calm.matches;
    };
    calm.addEventListener("change", setMotion);
    setMotion();
    const element = make("div", { class: "player", role: "group", "aria-label": `Animation of ${options.what}` },
        make("div", { class: "row" }, button("−", `${options.stepLabel} back`, () => options.advance(-options.step)),
            play, button("+", `${options.stepLabel} on`, () => options.advance(options.step))), pace);
    return { element, stop };
}
