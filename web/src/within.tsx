// What differs within subjects: between two visits (change), or between the sides (asymmetry).
import type * as api from './api';
import { DataTable } from './charts';
import { Amounts } from './charts_within';
import { PairedCharts } from './findings';
import { t, whole } from './i18n';
import { aPlace, maybe, useKept } from './kept';
import { Linked } from './paths';
import { Headline, TestedMaps } from './tested';
import { figure, plural, spread } from './ui';

/** Millimetres of a mesh are what nearly all files have; none says so. */
const UNIT = 'mm';

type Estimate = api.Outputs<'change'>['change'];
/** Ends are unknown where few subjects were measured repeatedly. */
const ends = (interval: (number | null)[], unit = '', digits = (v: number): string => figure(v)): string =>
    interval.every((v) => v === null) ? t`no interval` : `95 %: ${interval.map((v) => v === null ? 'unknown' : digits(v)).join(' to ')}${unit}`;
const estimate = (e: Estimate): string => `${figure(e.value)} ${UNIT} (${ends(e.interval)})`;
const share = (e: Estimate): string => `${e.value === null ? '–' : Math.round(100 * e.value)} % (${ends(e.interval, ' %', (v) => `${Math.round(100 * v)}`)})`;

const beside = (name: string) => [
    { name: 'normalEffect', text: t`${name} outwards`, unit: UNIT }, { name: 'effect', text: t`length of the ${name}`, unit: UNIT },
    { name: 'standardError', text: t`standard error`, unit: UNIT }, { name: 'confidence', text: t`half the region of confidence`, unit: UNIT },
    { name: 'statistic', text: "statistic (Hotelling's T²)" },
];

/** Sides that were measured repeatedly: whether they differ by more than measurements do. */
function Replicates({ of, subjects }: { of: Record<string, any>; subjects: number }) {
    const [between, within] = of.degreesOfFreedom;
    return (
        <section aria-label={t`Repeated measurements`}>
            <h2>{t`Repeated measurements`}</h2>
            <p class="big">F = {figure(of.f.value)} <span class="quiet">{t`(${ends(of.f.interval)}), p ${of.pValueIsFloor ? '≤' : '='} ${figure(of.pValue)}, ${whole(of.permutations)} permutations of measurements within subjects`}</span></p>
            <p>{t`${of.pValue <= 0.05 ? t`The sides of a subject differ by more than measurements of one side do: its fluctuating asymmetry is no error of measurement.`
                : t`That the sides of a subject differ by more than measurements of one side do was not shown: its fluctuating asymmetry may be error of measurement.`} Of the variance of a difference of two measurements ${share(of.repeatability)} is the subject's own.`}</p>
            <div class="split">
                <Amounts title={t`Fluctuating asymmetry and error of measurement`} name="replicates" unit="L2 of SRNFs" rows={[[t`without error`, of.fluctuating], [t`one measurement`, of.measured]]
                    .filter(([, e]) => typeof e.value === 'number').map(([name, e]) => ({ name, value: e.value, low: e.interval[0] ?? e.value, high: e.interval[1] ?? e.value }))} />
                <div>
                    <DataTable rows={[[t`source`, t`mean square`, t`degrees of freedom`], [t`individual`, spread(of.individual, of.individualInterval), subjects - 1], [t`side`, of.side, 1], [t`individual by side`, spread(of.interaction, of.interactionInterval), between], [t`error of measurement`, spread(of.error, of.errorInterval), within]]} />
                    <p class="quiet">{t`Of ${plural(of.measurements, 'measurement')}. All else on this page is of the means of the measurements of a side.`}</p>
                </div>
            </div>
        </section>
    );
}

export function Within({ result }: { result: api.Outputs<'change'> | api.Outputs<'asymmetry'> }) {
    const [chosen, setChosen] = useKept('chosen', undefined, maybe(aPlace(result.perSubject.length)));
    const sides = 'directional' in result;
    const cohort = result.inputs?.cohort ?? {};
    const times: number[] | undefined = cohort.times;
    const [first, second] = sides ? [t`left`, t`right`] : times ? times.map((time) => t`time ${figure(time)}`) : [t`before`, t`after`];
    const one = chosen === undefined ? undefined : result.perSubject[chosen];
    const shapeOf = (places?: number[]): string | undefined => (chosen === undefined ? undefined : cohort.surfaces?.[places?.[chosen] ?? -1]);
    const pair = [[shapeOf(cohort.first), first], [shapeOf(cohort.second), second]].filter(([id]) => id);
    return (
        <>
            <Headline test={result} against={`${result.exact ? t`all flips of signs` : t`${whole(result.permutations ?? 0)} flips of signs`}, ${plural(result.subjects, 'subject')}`} />
            {'directional' in result
                ? <p>{t`Directional asymmetry, what all subjects have in common from left to right:`} <strong>{estimate(result.directional)}</strong>{t`. Fluctuating asymmetry, how subjects differ in it:`} <strong>{estimate(result.fluctuating)}</strong>.</p>
                : <p>{t`From ${first} to ${second} the surface moves by`} <strong>{estimate(result.change)}</strong> {t`in the mean, and subjects vary about that by ${estimate(result.variation)}.`}</p>}
            <p>{t`${sides ? t`The directional part` : t`The mean change`} is ${share(result.share)} of all ${sides ? t`asymmetry` : t`change`}, by squares. Whatever the ${sides ? t`side` : t`time`}, subjects differ from each other by ${estimate(result.individual)}. In L2 of SRNFs the mean is ${spread(result.distance, result.distanceInterval)} long.`}</p>
            <p class="quiet">{t`Lengths are root mean squares over the surface, in the unit of the meshes, which is taken to be the millimetre.`}</p>
            {result.inputs?.scale === 'shape' && <p><strong>{t`Size was taken out:`}</strong> {t`the two surfaces of each subject were brought to one area, at their mean size. Lengths are those of shape alone.`}</p>}
            <TestedMaps surface={result.surface.id} test={result} beside={beside(sides ? 'asymmetry' : 'change')} />
            <p class="quiet">{t`Outward is positive${sides ? t`: there the right side is larger` : ''}. The region of confidence holds the mean at all points together, with 95 %.`}</p>
            {'replicates' in result && result.replicates && <Replicates of={result.replicates} subjects={result.subjects} />}
            <h2>{t`Subjects`}</h2>
            <div class="split"><PairedCharts result={result} chosen={chosen} onChoose={setChosen} /></div>
            {one && pair.length === 2
                ? <><h3>{one.subject}</h3><div class="split">{pair.map(([id, title]) => <Linked key={`${id}`} id={`${id}`} title={`${title}`} />)}</div></>
                : <p class="quiet no-report">{t`Choose a subject to see its two shapes.`}</p>}
            <DataTable rows={[[t`subject`, t`size, ${first}`, t`size, ${second}`, t`length`, t`along the mean`, t`from the mean of the others`, t`distance of SRNFs`],
                ...result.perSubject.map((s) => [s.subject, ...s.sizes, s.length, s.along, s.deviation, s.distance])]} />
            <p class="quiet">{t`Sizes are roots of areas. Lengths are root mean squares over the surface.`}</p>
        </>
    );
}
