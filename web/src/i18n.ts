// Texts in the language of the page. The English text is the key: t`${n} of ${all} members` is looked up as
// "{0} of {1} members". Where the language has none, it stays English.
import { language, translate } from './language';

type Value = string | number | null | undefined | boolean;
const shown = (v: Value): string => (v === null || v === undefined || typeof v === 'boolean' ? '' : `${v}`);
const filled = (text: string, values: Value[]): string => text.replace(/\{(\d+)\}/g, (_, n) => shown(values[n]));

export function t(texts: TemplateStringsArray, ...values: Value[]): string {
    const key = texts.reduce((all, text, i) => `${all}{${i - 1}}${text}`);
    return filled(translate?.(key) ?? key, values);
}

const ORDER = ['zero', 'one', 'two', 'few', 'many', 'other'] as const;
const rules = new Intl.PluralRules(language);
const forms = ORDER.filter((form) => rules.resolvedOptions().pluralCategories.includes(form));

/** A count with its noun: the key is "{0} mesh|{0} meshes", and a language has as many forms as it tells apart. */
export function plural(n: number, one: string, many = `${one}s`): string {
    const key = `{0} ${one}|{0} ${many}`;
    const other = translate?.(key)?.split('|');
    const form = other ? other[forms.indexOf(rules.select(n))] ?? other.at(-1)! : key.split('|')[n === 1 ? 0 : 1];
    return filled(form, [whole(n)]);
}

// Made once: a table asks for hundreds while it is scrolled.
const numbers = new Intl.NumberFormat(language);
const moments = new Intl.DateTimeFormat(language === 'en' ? undefined : language, { dateStyle: 'medium', timeStyle: 'short' });

export const whole = (n: number): string => numbers.format(n);

const point = new Intl.NumberFormat(language).formatToParts(1.5).find((part) => part.type === 'decimal')?.value ?? '.';
/** A figure with the decimal sign of the language. */
export const decimal = (text: string): string => (point === '.' ? text : text.replace('.', point));

export function when(text?: string): string {
    const at = text ? new Date(text) : null;
    return at && !Number.isNaN(at.getTime()) ? moments.format(at) : '–';
}
