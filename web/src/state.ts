// What all pages share: the connection, who calls, the jobs. A value with listeners, and a hook for it.
import { useEffect, useState } from 'preact/hooks';
import * as api from './api';

export class Value<T> {
    private listeners = new Set<() => void>();
    constructor(private current: T) {}
    get(): T {
        return this.current;
    }
    set(next: T): void {
        if (next === this.current) return;
        this.current = next;
        for (const listener of [...this.listeners]) listener();
    }
    listen(listener: () => void): () => void {
        this.listeners.add(listener);
        return () => this.listeners.delete(listener);
    }
}

export function useValue<T>(value: Value<T>): T {
    const [, again] = useState(0);
    const shown = value.get();
    useEffect(() => {
        const stop = value.listen(() => again((n) => n + 1));
        if (value.get() !== shown) again((n) => n + 1); // it has changed since this was drawn
        return stop;
    }, [value]);
    return shown;
}

/** up: it answers. down: it does not. token: it asks for one. */
export const connection = new Value<'up' | 'down' | 'token'>('up');
export const caller = new Value<api.Caller | null>(null);
export const jobs = new Value<api.Job[]>([]);
/** Said to those who hear the page, and shown for a moment to those who see it. */
export const notice = new Value<string>('');
export const say = (text: string): void => {
    notice.set('');
    notice.set(text);
};

/** Viewers may look only. */
export const mayChange = (): boolean => !['viewer', 'metrics'].includes(caller.get()?.role ?? 'user');

export const isActive = (job: api.Job): boolean => job.status === 'accepted' || job.status === 'running';

api.watchAnswers((status) => {
    if (status === 0 || status === 502 || status === 504) {
        if (connection.get() !== 'token') connection.set('down');
        again(2000);
    } else if (status === 401) connection.set('token');
    else if (connection.get() === 'down') {
        // Not where a token is asked for: what is open to everyone is answered there too.
        connection.set('up');
        void whoCalls();
    }
});

export async function whoCalls(): Promise<void> {
    try {
        caller.set(await api.get('/v1/caller'));
    } catch (error) {
        if (error instanceof api.Failure && error.problem.status === 404) caller.set({ tokens: false, role: 'user' });
    }
}

// ---- Jobs: one stream of all their changes; the list is read where it begins, and when places in the queue move -------

const LISTED = 50;
const ended = new Value<api.Job | null>(null);
export const onEnd = (told: (job: api.Job) => void): (() => void) =>
    ended.listen(() => {
        const job = ended.get();
        if (job) told(job);
    });

/** Does it once after so many milliseconds, or earlier if asked to. */
function later(act: () => void): (ms: number) => void {
    let timer = 0;
    let due = 0;
    return (ms) => {
        const at = Date.now() + ms;
        if (timer && due <= at) return;
        clearTimeout(timer);
        due = at;
        timer = window.setTimeout(() => {
            timer = 0;
            act();
        }, ms);
    };
}
const again = later(() => void follow());
const read = later(() => void readJobs());

function take(list: api.Job[]): void {
    const before = new Map(jobs.get().map((job) => [job.id, job]));
    jobs.set(list);
    for (const job of list) {
        const was = before.get(job.id);
        if (was && isActive(was) && !isActive(job)) {
            ended.set(job);
            say(`${job.name || job.process}: ${job.status}`);
        }
    }
}

/** What was told while the list was on its way is newer than the list. */
const newer = new Map<string, api.Job | null>();
let reading = false;

async function readJobs(): Promise<void> {
    if (reading || connection.get() === 'token') return;
    reading = true;
    newer.clear();
    try {
        const { items } = await api.jobs({ limit: LISTED });
        const known = new Set(items.map((j) => j.id));
        const added = [...newer.values()].filter((j): j is api.Job => !!j && !known.has(j.id));
        take(added.concat(items.filter((j) => newer.get(j.id) !== null).map((j) => newer.get(j.id) ?? j)));
    } catch {
        /* The connection's state says it. */
    }
    reading = false;
}

function told(event: api.StreamEvent): void {
    last = event.id || last;
    if (event.name === 'start') return read(0);
    const list = jobs.get();
    if (event.name === 'deleted') {
        const { id } = JSON.parse(event.data);
        newer.set(id, null);
        return jobs.set(list.filter((j) => j.id !== id));
    }
    const next = api.jobOf(JSON.parse(event.data));
    newer.set(next.id, next);
    // Places in the queue move when a job leaves it, and no event tells those.
    if (event.name === 'status' && list.some((j) => j.status === 'accepted' && j.id !== next.id)) read(1000);
    take(list.some((j) => j.id === next.id) ? list.map((j) => (j.id === next.id ? { ...next, inputs: j.inputs } : j))
        : [next, ...list].slice(0, LISTED));
}

let stream: AbortController | null = null;
let last = '';

/** One stream for all jobs: browsers open six connections to a host at most. */
async function follow(): Promise<void> {
    if (stream || document.hidden || connection.get() === 'token') return;
    const own = new AbortController();
    stream = own;
    let full = false;
    try {
        await api.events('/v1/events', last, told, own.signal);
    } catch (error) {
        // Too many streams, of this token or of all: the list is asked for instead until there is room.
        if (error instanceof api.Failure && error.problem.status) {
            full = true;
            read(0);
        }
    }
    if (stream === own) stream = null;
    again(full ? 5000 : connection.get() === 'down' ? 2000 : 500);
}

/** Looks at the jobs now, as after one was started. */
export function refreshJobs(): void {
    read(50);
    again(50);
}

/** Somebody else calls: begins anew. */
export function forgetJobs(): void {
    stream?.abort();
    stream = null;
    last = '';
    jobs.set([]);
}

// A page that nobody sees gives its connection back, and catches up when it is seen.
let hidden = 0;
document.addEventListener('visibilitychange', () => {
    clearTimeout(hidden);
    if (!document.hidden) again(0);
    else hidden = window.setTimeout(() => stream?.abort(), 30000);
});
