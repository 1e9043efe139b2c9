// The language of the page: the one that was chosen, of those that are here. Another is a file in src/ that gives for each
// English text its own (web/texts.mjs --list has all of them), and a line below; it is loaded where it is wanted alone.

/** For an English text that of a language; undefined: there is none. */
export type Translate = (english: string) => string | undefined;

interface Language { name: string; load?: () => Promise<{ translate: Translate }> }

export const LANGUAGES: Record<string, Language> = {
    en: { name: 'English' },
    'en-x-longer': { name: 'English, drawn out: tries the layout', load: () => import('./longer') },
};

const KEPT = 'srnfd-language';

function chosen(): string {
    try {
        return localStorage.getItem(KEPT) ?? '';
    } catch {
        return ''; // the browser keeps nothing
    }
}

/** From the next time that the page is loaded. */
export function choose(language: string): void {
    try {
        localStorage.setItem(KEPT, language);
    } catch {
        /* The browser keeps nothing. */
    }
}

const wanted = [chosen(), ...(navigator.languages ?? [])].find((code) => Object.hasOwn(LANGUAGES, code)) ?? 'en';
const loaded = await LANGUAGES[wanted].load?.().catch(() => undefined);
export const language = loaded || wanted === 'en' ? wanted : 'en';
export const translate: Translate | undefined = loaded?.translate;
document.documentElement.lang = language;
