// What a panel is: a part of the page beside the picture.
import type { Page } from "../app/page.ts";

export interface Panel {
    id: string;
    title: string;
    element: HTMLElement;
    /** True while it has something to offer for the scene that is open; absent: always. */
    isUseful?: () => boolean;
    /** True where it is the panel of the scene's lights, so that it is shown first. */
    isFirst?: () => boolean;
}

export type PanelMaker = (page: Page) => Panel;
