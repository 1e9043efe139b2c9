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
addEventListener('hashchange', () => route.set(read()));

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

/** Changes the query of the present address without a step in the history. */
export function remember(changes: Record<string, string | null>): void {
    const { path, query } = route.get();
    const next = new URLSearchParams(query);
    for (const [name, value] of Object.entries(changes)) value === null ? next.delete(name) : next.set(name, value);
    const text = next.toString();
    history.replaceState(null, '', link(...path) + (text ? `?${text}` : ''));
    route.set(read());
}
