// Keeps a few requests on their way and of those that wait only the newest: a slider that is dragged asks as often as
// the daemon answers, and never for a state that nobody will see.

export class Newest<Request, Answer> {
    private waiting: Request | null = null;
    private onTheirWay = 0;
    private sent = 0;
    private shown = 0;

    constructor(
        private readonly ask: (request: Request) => Promise<Answer>,
        private readonly show: (answer: Answer, request: Request) => void,
        private readonly fail: (reason: unknown) => void,
        private readonly most = 2,
    ) {}

    want(request: Request): void {
        this.waiting = request;
        this.send();
    }

    /** Answers to what was asked before are not shown any more. */
    forget(): void {
        this.waiting = null;
        this.shown = this.sent;
    }

    get isIdle(): boolean {
        return this.onTheirWay === 0 && this.waiting === null;
    }

    private send(): void {
        if (this.waiting === null || this.onTheirWay >= this.most) return;
        const request = this.waiting;
        const turn = ++this.sent;
        this.waiting = null;
        this.onTheirWay += 1;
        this.ask(request).then(
            (answer) => {
                this.onTheirWay -= 1;
                this.send();
                // An older answer that comes late is dropped.
                if (turn <= this.shown) return;
                this.shown = turn;
                this.show(answer, request);
            },
            (reason: unknown) => {
                this.onTheirWay -= 1;
                if (turn > this.shown) this.fail(reason);
                this.send();
            },
        );
    }
}
