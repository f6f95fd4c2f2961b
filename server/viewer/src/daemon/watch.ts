// A daemon that does not answer, or is too busy to: asked again until it is ready.

/** After the first miss, and between two of them, ms. */
const FIRST_MS = 500, AGAIN_MS = 1000;

export class Watch {
    isLost = false;
    /** Why, as a sentence. */
    why = "";

    constructor(private readonly isReady: () => Promise<boolean>, private readonly lost: () => void,
        private readonly found: () => void)
    {}

    lose(why: string): void {
        if (this.isLost) return;
        this.isLost = true;
        this.why = why;
        this.lost();
        const again = async (): Promise<void> => {
            if (!this.isLost) return;
            if (await this.isReady()) this.find();
            else setTimeout(() => void again(), AGAIN_MS);
        };
        setTimeout(() => void again(), FIRST_MS);
    }

    /** It has answered. */
    find(): void {
        if (!this.isLost) return;
        this.isLost = false;
        this.found();
    }
}
