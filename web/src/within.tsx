// What differs within subjects: between two visits (change), or between the sides (asymmetry).
import { useState } from 'preact/hooks';
import type * as api from './api';
import { DataTable } from './charts';
import { PairedCharts } from './findings';
import { Linked } from './paths';
import { Headline, TestedMaps } from './tested';
import { figure, plural } from './ui';

/** Millimetres of a mesh are what nearly all files have; none says so. */
const UNIT = 'mm';

type Estimate = api.Outputs<'change'>['change'];
const estimate = (e: Estimate): string => `${figure(e.value)} ${UNIT} (95 %: ${e.interval.map((v) => figure(v)).join(' to ')})`;
const share = (e: Estimate): string => `${e.value === null ? '–' : Math.round(100 * e.value)} % (95 %: ${e.interval.map((v) => Math.round(100 * v)).join(' to ')} %)`;

const beside = (name: string) => [
    { name: 'normalEffect', text: `${name} outwards`, unit: UNIT }, { name: 'effect', text: `length of the ${name}`, unit: UNIT },
    { name: 'standardError', text: 'standard error', unit: UNIT }, { name: 'confidence', text: 'half the region of confidence', unit: UNIT },
    { name: 'statistic', text: "statistic (Hotelling's T²)" },
];

export function Within({ result }: { result: api.Outputs<'change'> | api.Outputs<'asymmetry'> }) {
    const [chosen, setChosen] = useState<number | undefined>();
    const sides = 'directional' in result;
    const cohort = result.inputs?.cohort ?? {};
    const times: number[] | undefined = cohort.times;
    const [first, second] = sides ? ['left', 'right'] : times ? times.map((t) => `time ${figure(t)}`) : ['before', 'after'];
    const one = chosen === undefined ? undefined : result.perSubject[chosen];
    const shapeOf = (places?: number[]): string | undefined => (chosen === undefined ? undefined : cohort.surfaces?.[places?.[chosen] ?? -1]);
    const pair = [[shapeOf(cohort.first), first], [shapeOf(cohort.second), second]].filter(([id]) => id);
    return (
        <>
            <Headline test={result} against={`${result.exact ? 'all flips of signs' : `${(result.permutations ?? 0).toLocaleString('en')} flips of signs`}, ${plural(result.subjects, 'subject')}`} />
            {'directional' in result
                ? <p>Directional asymmetry, what all subjects have in common from left to right: <strong>{estimate(result.directional)}</strong>. Fluctuating asymmetry, how subjects differ in it: <strong>{estimate(result.fluctuating)}</strong>.</p>
                : <p>From {first} to {second} the surface moves by <strong>{estimate(result.change)}</strong> in the mean, and subjects vary about that by {estimate(result.variation)}.</p>}
            <p>{sides ? 'The directional part' : 'The mean change'} is {share(result.share)} of all {sides ? 'asymmetry' : 'change'}, by squares. Whatever the {sides ? 'side' : 'time'}, subjects differ from each other by {estimate(result.individual)}.</p>
            <p class="quiet">Lengths are root mean squares over the surface, in the unit of the meshes, which is taken to be the millimetre.</p>
            <TestedMaps surface={result.surface.id} test={result} beside={beside(sides ? 'asymmetry' : 'change')} />
            <p class="quiet">Outward is positive{sides ? ': there the right side is larger' : ''}. The region of confidence holds the mean at all points together, with 95 %.</p>
            <h2>Subjects</h2>
            <div class="split"><PairedCharts result={result} chosen={chosen} onChoose={setChosen} /></div>
            {one && pair.length === 2
                ? <><h3>{one.subject}</h3><div class="split">{pair.map(([id, title]) => <Linked key={`${id}`} id={`${id}`} title={`${title}`} />)}</div></>
                : <p class="quiet no-report">Choose a subject to see its two shapes.</p>}
            <DataTable rows={[['subject', `size, ${first}`, `size, ${second}`, 'length', 'along the mean', 'from the mean of the others', 'distance of SRNFs'],
                ...result.perSubject.map((s) => [s.subject, ...s.sizes, s.length, s.along, s.deviation, s.distance])]} />
            <p class="quiet">Sizes are roots of areas. Lengths are root mean squares over the surface.</p>
        </>
    );
}
