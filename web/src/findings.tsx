// Charts of results by what these hold: the same on the page and in a report.
import { Confusion, Curve, HeatMap, Intervals, Reliability, Scatter, Variance, scaling } from './charts';
import type * as api from './documents';
import { JointCharts, LandmarkChart, NeighbourCharts, Percentiles, checksOf, isJoint, isNeighbours } from './charts_joint';
import { TrajectoryCharts, isTrajectories } from './charts_time';
import { GroupLandmarks, MemberDistances, PartIntervals, ProbabilityScores, Rates, areOfGroup, hasDistances, hasParts } from './charts_group';
import { Amounts, Subjects } from './charts_within';
import { useMemo, useState } from 'preact/hooks';
import { t } from './i18n';

/** Scores of a model's members on two components, in standard deviations. */
function Scores({ model }: { model: any }) {
    const second = Math.min(1, model.eigenvalues.length - 1);
    const sd = (k: number) => Math.sqrt(model.eigenvalues[k]) || 1;
    const dots = model.scores.map((s: number[], i: number) => ({ x: s[0] / sd(0), y: s[second] / sd(second), name: model.labels?.[i] ?? `${i + 1}`, group: model.groups?.[i] }));
    return <Scatter title={t`Scores`} name="scores" dots={dots} labels={[t`component 1 (sd)`, t`component ${second + 1} (sd)`]} />;
}

function Distances({ result }: { result: any }) {
    const [chosen, setChosen] = useState<number | undefined>();
    const { points, share } = useMemo(() => scaling(result.matrix), [result]);
    return (
        <>
            <HeatMap labels={result.labels} matrix={result.matrix} chosen={chosen} onChoose={setChosen} />
            <Scatter equal title={t`Classical scaling: ${Math.round(100 * share)} % in two dimensions`} name="scaling" labels={[t`first`, t`second`]} chosen={chosen} onChoose={setChosen}
                dots={points.map(([x, y], i) => ({ x, y, name: result.labels[i], group: result.groups?.[i] }))} />
        </>
    );
}

const QUALITY: [string, string][] = [
    ['generalisation', t`Generalisation: how far left-out shapes stay`], ['specificity', t`Specificity: how far random shapes are from real ones`],
    ['compactness', t`Compactness: variance so far`],
];

/** What a classifier is worth: shares with their intervals, what was taken for what, and whether its probabilities hold. */
export function Assessment({ of, classes }: { of: any; classes: string[] }) {
    return (
        <div class="split">
            <Rates of={of} chance={Math.max(of.chance ?? 0, of.majorityRate ?? 0)} title={t`Accuracy`} name="accuracy" />
            <ProbabilityScores of={of} />
            {of.confusion && <Confusion classes={classes} counts={of.confusion} title={t`${of.correct} of ${of.members} right`} />}
            {Object.entries<any>(of.calibration ?? {}).map(([name, bins]) => <Reliability key={name} title={t`Probability of ${name}: said and so`} name={`calibration-${name}`} bins={bins} />)}
        </div>
    );
}

/** How large differences within subjects are, and what each subject does; in the unit of the meshes. */
export function PairedCharts({ result, chosen, onChoose }: { result: api.Outputs<'change'> | api.Outputs<'asymmetry'>; chosen?: number; onChoose?: (i: number) => void }) {
    const sides = 'directional' in result;
    const amounts: [string, any][] = 'directional' in result ? [[t`directional`, result.directional], [t`fluctuating`, result.fluctuating]] : [[t`change`, result.change], [t`variation of it`, result.variation]];
    const rows = [...amounts, [t`between subjects`, result.individual] as [string, any]].filter(([, e]) => typeof e?.value === 'number')
        .map(([name, e]) => ({ name, value: e.value, low: e.interval[0], high: e.interval[1] }));
    const subjects = result.perSubject.map((s) => ({ name: s.subject, along: s.along ?? 0, length: s.length ?? 0 }));
    return (
        <>
            <Amounts title={t`How large it is, with 95 % intervals`} name="amounts" unit="mm" rows={rows} />
            <Subjects title={sides ? t`Asymmetry of each subject` : t`Change of each subject`} unit="mm" subjects={subjects} chosen={chosen} onChoose={onChoose} />
        </>
    );
}

const isPaired = (result: any): boolean => !!result.individual && Array.isArray(result.perSubject) && result.perSubject.length > 0 && 'along' in result.perSubject[0];

/** All charts that can be drawn of a result. */
export function Findings({ result }: { result: any }) {
    const model = result.model;
    // The variance of components is a chart of its own.
    const curves = (model?.eigenvalues ? [] : QUALITY).map(([name, title]) => {
        const points = (result[name] ?? []).filter((p: any) => typeof p?.value === 'number').map((p: any) => ({ x: p.components, y: p.value, error: p.standardError }));
        return points.length > 1 ? <Curve key={name} title={title} name={name} points={points} labels={[t`components`, name]} /> : null;
    });
    return (
        <>
            {model?.eigenvalues?.length > 0 && model.scores?.length > 0 && !['classifier', 'parts'].includes(model.kind) && (
                <div class="split"><Scores model={model} /><Variance explained={model.explained} cumulative={model.cumulative} /></div>
            )}
            {result.methods && (
                <div class="split">
                    <Intervals chance={Math.max(result.chance, result.majorityRate)} rows={Object.entries<any>(result.methods).map(([name, m]) => ({ name, value: m.accuracy, low: m.confidenceInterval[0], high: m.confidenceInterval[1], p: m.pValue }))} />
                    {Object.entries<any>(result.methods).map(([name, m]) => <Rates key={name} of={m} chance={Math.max(result.chance, result.majorityRate)} title={name} name={`rates-${name}`} />)}
                    {Object.entries<any>(result.methods).map(([name, m]) => <Confusion key={name} classes={result.classes} counts={m.confusion} title={t`${name}: ${m.correct} of ${m.perSubject.length} right`} />)}
                </div>
            )}
            {hasParts(result) && <div class="split">{Object.keys(result.methods).map((name) => <PartIntervals key={name} result={result} method={name} />)}</div>}
            {hasDistances(result) && <div class="split"><MemberDistances result={result} /></div>}
            {result.matrix?.length > 1 && result.labels && <div class="split"><Distances result={result} /></div>}
            {isPaired(result) && <div class="split"><PairedCharts result={result} /></div>}
            {curves.some(Boolean) && <div class="split">{curves}</div>}
            {checksOf(result.calibration).length > 0 && <Percentiles checks={checksOf(result.calibration)} />}
            {isTrajectories(result) && <div class="split"><TrajectoryCharts result={result} /></div>}
            {isJoint(result) && <div class="split"><JointCharts result={result} /></div>}
            {isNeighbours(result) && <div class="split"><NeighbourCharts result={result} /></div>}
            {result.landmarks?.points?.length > 0 && (areOfGroup(result.landmarks) ? <GroupLandmarks points={result.landmarks.points} /> : <LandmarkChart points={result.landmarks.points} />)}
            {(result.validation ?? result.assessment) && <Assessment of={result.validation ?? result.assessment} classes={result.classes} />}
        </>
    );
}
