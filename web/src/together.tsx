// Subjects classified by all their structures together, and by each alone.
import * as api from './api';
import { Confusion, DataTable, Intervals } from './charts';
import { PartIntervals, Rates } from './charts_group';
import { GROUPS } from './colours';
import { t } from './i18n';
import { aPlace, maybe, oneOf, useKept } from './kept';
import { Linked } from './paths';
import { errorOf, figure, plural } from './ui';

const percent = (v: number): string => `${figure(100 * v)} %`;
const p = (m: any): string => (m.pValue === null || m.pValue === undefined ? '' : `, ${m.pValueIsFloor ? 'p ≤ ' : 'p = '}${figure(m.pValue)}${errorOf(m.pValueInterval)}`);

/** By which a subject is unlike all that the method learnt from. */
export const doubtful = (typicality: any): string => Object.entries<any>(typicality ?? {}).filter(([, t]) => t && t.value > t.limit).map(([name]) => api.words(name).toLowerCase()).join(', ');

/** Pairs of methods, by the members that only one of them gets right. */
export function Comparisons({ list }: { list?: any[] }) {
    if (!list?.length) return null;
    return (
        <>
            <h2>{t`Methods against each other`}</h2>
            <DataTable rows={[[t`method`, t`against`, t`right by the first alone`, t`right by the second alone`, t`p (McNemar, exact)`], ...list.map((c) => [c.first, c.second, c.onlyFirst, c.onlySecond, c.pValue])]} />
        </>
    );
}

/** The shapes of a subject, one of each structure. */
function Structures({ result, subject }: { result: any; subject: number }) {
    const { surfaces = [] } = result.inputs?.cohort ?? {};
    const ids: string[] = result.parts.map((_: unknown, k: number) => surfaces[k * result.subjects + subject]);
    return <div class="gallery">{ids.map((id, k) => id && <Linked key={id} id={id} title={result.parts[k].name} colour={GROUPS[k % GROUPS.length]} />)}</div>;
}

export function Together({ result }: { result: api.Outputs<'classify-parts'> }) {
    const names = Object.keys(result.methods);
    const [method, setMethod] = useKept('method', names[0], oneOf(names));
    const [chosen, setChosen] = useKept('chosen', undefined, maybe(aPlace(result.subjects)));
    const m = result.methods[method];
    const one = chosen === undefined ? undefined : m.perSubject[chosen];
    const missed = m.perSubject.filter((s: any) => s.predicted !== s.label).length;
    return (
        <>
            <p class="big">{t`${m.correct} of ${plural(result.subjects, 'subject')} right`} <span class="quiet">{t`${method}, by ${plural(result.parts.length, 'structure')} together: ${percent(m.accuracy)} (${m.confidenceInterval.map((v: number) => figure(100 * v)).join(' to ')} %)${p(m)}`}</span></p>
            <p class="quiet">{t`Always the most frequent label: ${percent(result.majorityRate)}. ${result.features.length ? t`Beside the shapes count: ${result.features.join(', ')}.` : t`Nothing counts but the shapes.`}`}</p>
            {names.length > 1 && <div class="row tools no-report"><label>{t`Method`} <select value={method} onChange={(e) => setMethod(e.currentTarget.value)}>{names.map((n) => <option>{n}</option>)}</select></label></div>}
            <div class="split">
                <PartIntervals result={result} method={method} />
                <Rates of={m} chance={Math.max(result.chance, result.majorityRate)} title={method} name={`rates-${method}`} />
                <Confusion classes={result.classes} counts={m.confusion} title={t`${method}: ${m.correct} of ${m.perSubject.length} right`} />
                {names.length > 1 && <Intervals title={t`All structures together`} chance={Math.max(result.chance, result.majorityRate)} rows={names.map((name) => {
                    const r = result.methods[name];
                    return { name, value: r.accuracy, low: r.confidenceInterval[0], high: r.confidenceInterval[1], p: r.pValue };
                })} />}
            </div>
            <h2>{t`Each structure alone`}</h2>
            <DataTable rows={[[t`structure`, t`weight`, t`right`, t`accuracy`, t`95 % from`, t`to`, t`right together alone`, t`right by it alone`, t`p (McNemar, exact)`],
                ...result.parts.map((part: any) => {
                    const own = part.methods[method];
                    return [part.name, part.weight, own.correct, own.accuracy, ...own.confidenceInterval, own.onlyTogether, own.onlyAlone, own.pValue];
                })]} />
            <p class="quiet">{t`By the same folds, and without other numbers. p is of the question whether the structure alone is right as often as all together.`}</p>
            <Comparisons list={result.comparisons} />
            <h2>{t`Subjects: ${missed} missed`}</h2>
            <div class="scroll" tabIndex={0} role="region" aria-label={t`Subjects and what they were taken for`}><table>
                <thead><tr><th scope="col">{t`Subject`}</th><th scope="col">{t`Is`}</th><th scope="col">{t`Taken for`}</th><th scope="col">{t`Unlike all by`}</th></tr></thead>
                <tbody>{m.perSubject.map((s: any, i: number) => (
                    <tr><td><button class="plain-button" aria-pressed={i === chosen} onClick={() => setChosen(i)}>{s.subject}</button></td><td>{s.label}</td>
                        <td>{s.predicted === s.label ? s.predicted : <strong class="wrong">{s.predicted}</strong>}</td><td>{doubtful(s.typicality) || '–'}</td></tr>
                ))}</tbody>
            </table></div>
            {one ? <><h3>{one.subject}</h3><Structures result={result} subject={chosen!} /></> : <p class="quiet no-report">{t`Choose a subject to see its structures.`}</p>}
        </>
    );
}
