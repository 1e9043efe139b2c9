// How subjects change with time: the mean slope and where it is, predicted surfaces over time, each subject's line and how
// it is beside those of the others.
import type * as api from './api';
import { DataTable } from './charts';
import { TrajectoryCharts } from './charts_time';
import { t, whole } from './i18n';
import { aPlace, maybe, useKept } from './kept';
import { Coefficients, Predicted, Terms } from './linear';
import { Linked } from './paths';
import { Headline, TestedMaps } from './tested';
import { figure, plural, spread } from './ui';

const RATE = t`mm per unit of time`;
const interval = (e: any): string => e.interval.map((v: number) => figure(v)).join(' to ');
const rate = (e: any): string => `${figure(e.value)} ${RATE} (95 %: ${interval(e)})`;

const BESIDE = [
    { name: 'normalEffect', text: t`slope outwards`, unit: RATE }, { name: 'effect', text: t`length of the slope`, unit: RATE },
    { name: 'standardError', text: t`standard error`, unit: RATE }, { name: 'confidence', text: t`half the region of confidence`, unit: RATE },
    { name: 'statistic', text: "statistic (Hotelling's T²)" },
];

/** The shapes of a subject, in the order of its visits. */
function Visits({ result, subject }: { result: any; subject: string }) {
    const cohort = result.inputs?.cohort ?? {};
    const visits = (cohort.subjects ?? []).flatMap((s: string, i: number) => (s === subject ? [{ id: cohort.surfaces?.[i], time: cohort.times?.[i] }] : []))
        .filter((v: any) => v.id).sort((a: any, b: any) => a.time - b.time);
    if (!visits.length) return null;
    return <div class="gallery">{visits.map((v: any) => <Linked key={v.id} id={v.id} title={typeof v.time === 'number' ? t`time ${figure(v.time)}` : subject} />)}</div>;
}

export function Trajectories({ result }: { result: api.Outputs<'trajectories'> }) {
    const [chosen, setChosen] = useKept('chosen', undefined, maybe(aPlace(result.perSubject.length)));
    const slope: any = result.slope;
    const flips = slope.exact ? t`all flips of signs` : t`${whole(slope.permutations ?? 0)} flips of signs`;
    const one: any = chosen === undefined ? undefined : result.perSubject[chosen];
    return (
        <>
            <Headline test={slope} against={t`${flips} of whole subjects, ${plural(result.subjects, 'subject')}, ${plural(result.members, 'visit')}`} />
            <p>{t`In the mean the surface moves by`} <strong>{rate(slope.rate)}</strong>{t`; slopes of subjects vary about that by ${rate(slope.variation)}, with what each is measured wrongly by. The mean is ${figure(100 * slope.share.value)} % (95 %: ${slope.share.interval.map((v: number) => figure(100 * v)).join(' to ')} %) of all slopes, by squares.`}</p>
            <p>{result.within === null ? '' : t`Visits lie about their lines with a variance of ${spread(result.within, result.withinInterval)} of SRNFs. `}{t`Slopes differ between subjects with a variance of ${spread(result.between, result.betweenInterval)} of SRNFs. The mean slope is ${spread(slope.distance, slope.distanceInterval)} long in L2 of SRNFs.`}</p>
            <p class="quiet">{t`Lengths are root mean squares over the surface, in the unit of the meshes, which is taken to be the millimetre. ${result.weighted ? t`Slopes weigh by how well each is known.` : t`All slopes weigh the same.`}`}</p>
            {result.inputs?.scale === 'shape' && <p><strong>{t`Size was taken out:`}</strong> {t`the surfaces of each subject were brought to one area, at their mean size. Slopes are those of shape alone.`}</p>}
            <Predicted process="trajectories" result={result} always={['time']} />
            <h2>{t`Subjects`}</h2>
            <div class="split"><TrajectoryCharts result={result} chosen={chosen} onChoose={setChosen} /></div>
            {one ? (
                <>
                    <h3>{one.subject}</h3>
                    <p>{t`${figure(one.speed)} times as fast as the others let expect, faster than ${spread(one.speedPercentile, one.speedPercentileInterval)} % of them; how unlike theirs its slope is exceeds ${spread(one.percentile, one.percentileInterval)} %.`}</p>
                    <Visits result={result} subject={one.subject} />
                </>
            ) : <p class="quiet no-report">{t`Choose a subject to see the shapes of its visits.`}</p>}
            <DataTable rows={[[t`subject`, t`visits`, t`from`, t`to`, t`length of its slope`, t`along the others`, t`speed beside theirs`, t`percentile of speed`, t`unlike theirs (sd)`, t`percentile of that`, t`weight`],
                ...result.perSubject.map((s: any) => [s.subject, s.visits, s.times?.[0], s.times?.[1], s.length, s.along, s.speed, s.speedPercentile, s.oddness, s.percentile, s.weight])]} />
            <p class="quiet">{t`Each subject is judged by what the others predict for it; percentiles are among subjects that were left out in the same way.`}</p>
            {result.formula && <><h2>{t`What slopes depend on`}</h2><p class="big"><code>{result.formula}</code></p><Terms result={result} /></>}
            <h2>{t`Where the mean slope is`}</h2>
            <TestedMaps surface={result.surface.id} test={slope} beside={BESIDE} />
            <Coefficients result={result} what={t`What a unit of a covariate adds to slopes`} />
        </>
    );
}
