// What a permutation test found: p in words, and its maps, grey where p exceeds a threshold.
import { useState } from 'preact/hooks';
import type { Field } from './glb';
import { t } from './i18n';
import { aNumber, oneOf, useKept } from './kept';
import { ColourBar, mapOf, paintedBy } from './maps';
import { link } from './router';
import { PictureButtons, View, linked, surfacePath, useShape } from './shape';
import { ProblemBox, errorOf, figure } from './ui';

export interface Test {
    pValue: number | null; pValueIsFloor?: boolean; pValueInterval?: (number | null)[];
    leastSignificance?: number | null; leastSignificanceInterval?: (number | null)[]; leastFdr?: number | null;
}

/** The p of the test as a headline, and what it was compared with. */
export function Headline({ test, against }: { test: Test; against: string }) {
    const [low, high] = test.pValueInterval ?? [];
    return (
        <p class="big">{test.pValueIsFloor ? 'p ≤ ' : 'p = '}{figure(test.pValue)}{typeof low === 'number' && low !== high ? t` (all permutations would give ${figure(low)} to ${figure(high)}, at 95 %)` : ''}
            {' '}<span class="quiet">{against}</span></p>
    );
}

/** A map beside p: its name, what the page calls it, and the unit that its values are in. */
export interface Beside { name: string; text: string; unit?: string }

export function TestedMaps({ surface, test, beside }: { surface: string; test: Test; beside: Beside[] }) {
    const { shape, error } = useShape(surfacePath(surface, 32));
    const [threshold, setThreshold] = useKept('p', 0.05, aNumber(0, 1));
    const [corrected, setCorrected] = useKept('corrected', 'significance', oneOf(['significance', 'fdr']));
    const [chosen, setChosen] = useKept('beside', beside[0].name, oneOf(beside.map((b) => b.name)));
    const [read, setRead] = useState('');
    const [here, setHere] = useState<number | undefined>();
    if (error) return <ProblemBox error={error} />;
    const least = corrected === 'fdr' ? test.leastFdr : test.leastSignificance;
    const p = shape?.fields.find((f) => f.name === corrected);
    const about = beside.find((b) => b.name === chosen)!;
    const other = shape?.fields.find((f) => f.name === chosen);
    const keep = p && ((_: number, vertex: number) => p.values[vertex] <= threshold);
    const any = p ? p.low <= threshold : false;
    const unit = about.unit ? ` ${about.unit}` : '';
    const at = (vertex: number) => (other ? t`, the ${about.text} ${figure(other.values[vertex])}${unit}` : '');
    const readLeast = (field: Field) => {
        let best = 0;
        for (let i = 1; i < field.values.length; i++) if (field.values[i] < field.values[best]) best = i;
        setRead(t`Least p ${figure(field.values[best])}${at(best)}, at vertex ${best}`);
    };
    return (
        <>
            <div class="row tools no-report">
                <label>{t`Grey where p exceeds`} <input type="number" min={0} max={1} step={0.01} value={threshold} onInput={(e) => setThreshold(+e.currentTarget.value)} /></label>
                <label>p <select value={corrected} onChange={(e) => setCorrected(e.currentTarget.value)}>
                    <option value="significance">{t`corrected for all points`}</option><option value="fdr">{t`false discovery rate`}</option>
                </select></label>
                {beside.length > 1 && <label>{t`Beside it`} <select value={chosen} onChange={(e) => setChosen(e.currentTarget.value)}>
                    {beside.map((b) => <option value={b.name}>{b.text}</option>)}
                </select></label>}
            </div>
            <p class={any ? '' : 'big'} role="status">{p ? (any ? t`Points with p of at most ${figure(threshold)} are in colour.` : t`No point is significant: the least p is ${figure(least ?? p.low)}${corrected === 'fdr' ? '' : errorOf(test.leastSignificanceInterval)}.`) : ''}</p>
            <div class="split">
                {shape && p && [p, other].map((field) => field && (() => {
                    const map = { ...mapOf(field), keep, ...(field === p ? { high: any ? threshold || 1 : 1, title: corrected === 'fdr' ? t`false discovery rate` : t`p, corrected for all points` } : { title: `${about.text}${about.unit ? ` (${about.unit})` : ''}` }) };
                    const parts = [{ shape, colours: paintedBy(map) }];
                    return (
                        <figure class="shape">
                            <View parts={parts} camera={linked} onHover={setHere} label={t`Map of ${field.name}; ${any ? t`points that are significant are in colour` : t`no point is significant, all is grey`}`} />
                            <ColourBar map={map} threshold={field === p && !any ? threshold : undefined} />
                            <figcaption class="row">{field === p ? t`p at each point` : about.text}{field.meaning ? <span class="quiet">{field.meaning}</span> : null}
                                <span class="no-report"><PictureButtons parts={parts} camera={linked} name={`map-${field.name}`} map={map} /></span>
                                {field === p && <button class="no-report" onClick={() => readLeast(p)}>{t`Read the least`}</button>}
                            </figcaption>
                        </figure>
                    );
                })())}
            </div>
            <p class="quiet no-report">{here === undefined || !p ? t`Point at a map to read it.` : t`Here p is ${figure(p.values[here])}${at(here)}, at vertex ${here}.`}</p>
            {read && <p role="status">{read}</p>}
            <div class="actions no-report"><a class="button" href={link('shapes', surface)}>{t`Maps as files`}</a></div>
        </>
    );
}
