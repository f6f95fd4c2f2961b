// Tells those who listen of events, by their names.

export class Events<Event extends string> {
    private readonly listeners = new Map<Event, Set<() => void>>();

    on(event: Event, listener: () => void): void {
        if (!this.listeners.has(event)) this.listeners.set(event, new Set());
        this.listeners.get(event)?.add(listener);
    }

    tell(event: Event): void {
        for (const listener of this.listeners.get(event) ?? []) listener();
    }
}
