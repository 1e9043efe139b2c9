// Addresses after '#', so that a link restores the page: #/cohorts/NAME?tab=table
import { useValue, Value } from './state';

export interface Route { path: string[]; query: URLSearchParams }

function read(): Route {
    const [path, query] = location.hash.replace(/^#\/?/, '').split('?');
    return {
        path: path.split('/').filter(Boolean).map((part) => {
            try {
                return decodeURIComponent(part);
            } catch {
                return part;
            }
        }),
        query: new URLSearchParams(query ?? ''),
    };
}

export const route = new Value<Route>(read());
/** How often one came to an address, by a link or back and forth in the history. */
export const came = new Value(0);
addEventListener('hashchange', () => {
    route.set(read());
    came.set(came.get() + 1);
});

export const useRoute = (): Route => useValue(route);
export const link = (...path: string[]): string => `#/${path.map(encodeURIComponent).join('/')}`;
/** Whether the page was left by a link: then the next begins at its top, and not where one was when one goes back. */
let fresh = false;
addEventListener('click', (event) => { fresh = !!(event.target as Element).closest?.('a[href^="#"]'); }, true);

export function begin(): void {
    if (fresh) scrollTo(0, 0);
    fresh = false;
}

export const go = (href: string): void => {
    fresh = true;
    location.hash = href.replace(/^#/, '');
};

/** Goes on from this page, for when something that takes a while is done: whoever has left it meanwhile stays where they are. */
export function fromHere(): (href: string) => void {
    const here = () => location.hash.split('?')[0];
    const before = here();
    return (href) => { if (here() === before) go(href); };
}

export const queryOf = (): URLSearchParams => read().query;

/** Changes the query of the present address without a step in the history. Pages are not drawn anew: they know already. */
export function remember(changes: Record<string, string | null>): void {
    const { path, query } = read();
    for (const [name, value] of Object.entries(changes)) value === null ? query.delete(name) : query.set(name, value);
    // What an address may show as it is stays readable.
    const text = query.toString().replace(/%3A/g, ':').replace(/%2C/g, ',').replace(/%3B/g, ';');
    history.replaceState(null, '', link(...path) + (text ? `?${text}` : ''));
}
