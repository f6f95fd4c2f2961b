// Tells those who listen of events, by their names. `Told` has for each event what is told with it.

export interface Observable<Told extends { [event: string]: unknown[] }> {
    on<Event extends keyof Told>(event: Event, listener: (...of: Told[Event]) => void): void;
}

export class Events<Told extends { [event: string]: unknown[] }> implements Observable<Told> {
    private readonly listeners: { [Event in keyof Told]?: Set<(...of: Told[Event]) => void> } = {};

    on<Event extends keyof Told>(event: Event, listener: (...of: Told[Event]) => void): void {
        (this.listeners[event] ??= new Set()).add(listener);
    }

    tell<Event extends keyof Told>(event: Event, ...of: Told[Event]): void {
        for (const listener of this.listeners[event] ?? []) listener(...of);
    }
}
