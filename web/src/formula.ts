// What a formula names, and which values members have of it.
import type * as api from './documents';

/** Names of a formula in their order: those of functions, which a bracket follows, are none. */
export function namesIn(formula: string): string[] {
    const right = formula.includes('~') ? formula.slice(formula.indexOf('~') + 1) : formula;
    const bare = right.replace(/Treatment\s*\([^)]*\)/g, '');
    const found = bare.match(/`[^`]+`|Q\(\s*(?:"(?:\\.|[^"\\])+"|'(?:\\.|[^'\\])+')\s*\)|[\p{L}_][\p{L}\p{N}_.]*(?!\s*\(|[\p{L}\p{N}_.])/gu) ?? [];
    return [...new Set(found.map(unquoted))];
}

/** The name itself; in Q("..") a backslash is left out before a quote and before another. */
function unquoted(name: string): string {
    const quoted = /^Q\(\s*["'](.*)["']\s*\)$/su.exec(name);
    return quoted ? quoted[1].replace(/\\(["'\\])/g, '$1') : name.replace(/^`|`$/g, '');
}

/** With one term more; names that are no words are quoted. */
export function withTerm(formula: string, name: string): string {
    const term = /^[\p{L}_][\p{L}\p{N}_.]*$/u.test(name) ? name : name.includes('`') ? `Q("${name.replace(/["\\]/g, '\\$&')}")` : `\`${name}\``;
    const text = formula.trim();
    return text === '' ? `shape ~ ${term}` : text.endsWith('~') ? `${text} ${term}` : `${text} + ${term}`;
}

type Value = string | number | boolean;

/** Of one member; what it does not have is undefined. */
export function valueOf(member: api.Member, name: string): Value | undefined {
    const own: Record<string, unknown> = { label: member.label, group: member.label, time: member.time, side: member.side, subject: member.subject };
    return (member.covariates?.[name] ?? own[name] ?? undefined) as Value | undefined;
}

export interface Covariate { name: string; numeric: boolean; low: number; high: number; levels: Value[] }

/** Numbers with their range, everything else with its levels; names that no member has are left out. */
export function covariatesOf(members: api.Member[], names: string[]): Covariate[] {
    return names.flatMap((name) => {
        const values = members.map((m) => valueOf(m, name)).filter((v): v is Value => v !== undefined);
        if (!values.length) return [];
        const numbers = values.filter((v): v is number => typeof v === 'number');
        const numeric = numbers.length === values.length;
        return [{ name, numeric, low: Math.min(...numbers), high: Math.max(...numbers), levels: [...new Set(values)].sort() }];
    });
}

/** Rounds to so many digits as tell the values of a range apart. */
const tidy = (v: number, range: number): number => +v.toFixed(Math.max(0, 2 - Math.floor(Math.log10(range || 1))));

/** Five points from the least to the largest value of a number, or the levels of a factor. */
export const placesAlong = (c: Covariate): Value[] => !c.numeric ? c.levels : c.low === c.high ? [c.low]
    : [0, 1, 2, 3, 4].map((k) => (k === 0 ? c.low : k === 4 ? c.high : tidy(c.low + ((c.high - c.low) * k) / 4, c.high - c.low)));

/** Points along one covariate, for each level of another. */
export function pointsAlong(along: Covariate, each?: Covariate): Record<string, Value>[] {
    return (each ? each.levels : [undefined]).flatMap((level) => placesAlong(along).map((v) => ({ [along.name]: v, ...(each ? { [each.name]: level! } : {}) })));
}
