// Linear models of shape: what terms explain, what coefficients move, and predicted shapes along covariates.
import { useEffect, useMemo, useState } from 'preact/hooks';
import { Along } from './along';
import type { Prediction } from './along';
import * as api from './api';
import { DataTable } from './charts';
import { covariatesOf, namesIn, pointsAlong } from './formula';
import type { Covariate } from './formula';
import { t, whole } from './i18n';
import { aPlace, useKept } from './kept';
import { Shape, surfacePath } from './shape';
import { mayChange, refreshJobs } from './state';
import { ProblemBox, errorOf, figure, plural, spread } from './ui';

const pOf = (test: any): string => `${test.pValueIsFloor ? '≤ ' : ''}${figure(test.pValue)}${errorOf(test.pValueInterval)}`;
const shareOf = (test: any): string => `${figure(test.r2)} (${test.r2Interval?.map((v: number) => figure(v)).join(' to ') ?? '–'})`;

export function Terms({ result }: { result: any }) {
    const rows = [...(result.terms ?? []).map((t: any) => [t.name, t]), [t`all terms`, result.model]].filter(([, t]) => t) as [string, any][];
    if (!rows.length) return null;
    return (
        <>
            <DataTable rows={[[t`term`, t`p (of all permutations, 95 %)`, t`share of the variance (95 %)`, t`least p on the map`, 'F', t`degrees of freedom`],
                ...rows.map(([name, t]) => [name, pOf(t), shareOf(t), `${figure(t.leastSignificance)}${errorOf(t.leastSignificanceInterval)}`, figure(t.f), `${t.degreesOfFreedom}, ${t.residualDegreesOfFreedom}`])]} />
            {result.residualVariance !== undefined && <p class="quiet">{t`Variance of SRNFs ${spread(result.variance, result.varianceInterval)}, of which terms leave ${spread(result.residualVariance, result.residualVarianceInterval)}.`}</p>}
            {result.pairwise?.length > 0 && <><h3>{t`Pairs of levels`}</h3><DataTable rows={[[t`term`, t`levels`, t`p (of all permutations, 95 %)`, t`corrected p`], ...result.pairwise.map((p: any) => [p.term, p.levels?.join(' and '), pOf(p), figure(p.correctedP)])]} /></>}
        </>
    );
}

export function Coefficients({ result, what }: { result: any; what: string }) {
    const known: any[] = (result.coefficients ?? []).filter((c: any) => c.surface);
    const [chosen, setChosen] = useKept('coefficient', 0, aPlace(known.length));
    const coefficient = known[chosen];
    if (!coefficient) return null;
    return (
        <>
            <h2>{what}</h2>
            <label class="no-report">{t`Coefficient`} <select value={chosen} onChange={(e) => setChosen(+e.currentTarget.value)}>
                {known.map((c, i) => <option value={i}>{c.name}</option>)}
            </select></label>
            <p>{t`Its norm in L2 of SRNFs is ${spread(coefficient.norm, coefficient.normInterval)}.`}</p>
            <Shape key={coefficient.surface.id} src={surfacePath(coefficient.surface.id, 32)} label={t`Mean with the maps of ${coefficient.name}`} name={coefficient.name} first="normalEffect" />
        </>
    );
}

// ---- Predicted shapes ------------------------------------------------------------------------------------------------

/** Inputs that make the same model, with little spent on tests that were made already. */
function sameModel(given: any): Record<string, unknown> {
    const names = ['formula', 'register', 'commonPose', 'lmax', 'mixedRoutes', 'tolerance', 'maxIterations', 'scale'];
    const kept = names.filter((name) => given[name] !== undefined && given[name] !== null);
    return { cohort: given.cohort.name, ...Object.fromEntries(kept.map((name) => [name, given[name]])), permutations: 19, bootstraps: 100 };
}

const LEVELS_MAX = 4;

/** Predictions of the result, and others that are asked for here: along a covariate, for each level of another. */
export function Predicted({ process, result, always = [] }: { process: 'regress' | 'trajectories'; result: any; always?: string[] }) {
    const given = result.inputs ?? {};
    const [made, setMade] = useState<Prediction[]>();
    const [members, setMembers] = useState<api.Member[]>();
    const [along, setAlong] = useState('');
    const [each, setEach] = useState('');
    const [busy, setBusy] = useState(false);
    const [error, setError] = useState<unknown>();
    useEffect(() => {
        let gone = false;
        if (given.cohort?.name) api.cohort(given.cohort.name).then((c) => !gone && setMembers(c.members ?? []), () => {});
        return () => { gone = true; };
    }, [given.cohort?.name]);
    const names = useMemo(() => [...always, ...namesIn(result.formula ?? '')].filter((n, i, all) => all.indexOf(n) === i), [result]);
    const covariates = useMemo(() => (members ? covariatesOf(members, names) : []), [members, names]);
    const factors = covariates.filter((c) => !c.numeric && c.levels.length > 1 && c.levels.length <= LEVELS_MAX);
    const chosen: Covariate | undefined = covariates.find((c) => c.name === along) ?? covariates.find((c) => c.numeric) ?? covariates[0];
    const split = factors.find((c) => c.name === each && c !== chosen);
    const shown: Prediction[] = made ?? result.predictions ?? [];
    const find = async () => {
        setBusy(true);
        setError(undefined);
        try {
            const answer: any = await api.run(process, { ...sameModel(given), at: pointsAlong(chosen!, split) } as any);
            setMade(answer.predictions);
            refreshJobs();
        } catch (e) {
            setError(e);
        }
        setBusy(false);
    };
    if (!shown.length && !chosen) return null;
    return (
        <section aria-label={t`Predicted shapes`}>
            <h2>{t`Predicted shapes`}</h2>
            {shown.length > 0 && <Along key={shown[0].surface.id + shown.length} predictions={shown} />}
            {chosen && mayChange() && (
                <div class="row tools no-report">
                    <label>{shown.length ? t`Others along` : t`Along`} <select value={chosen.name} onChange={(e) => setAlong(e.currentTarget.value)}>
                        {covariates.map((c) => <option>{c.name}</option>)}
                    </select></label>
                    {factors.some((c) => c !== chosen) && <label>{t`for each`} <select value={split?.name ?? ''} onChange={(e) => setEach(e.currentTarget.value)}>
                        <option value="">–</option>{factors.filter((c) => c !== chosen).map((c) => <option>{c.name}</option>)}
                    </select></label>}
                    <button disabled={busy} onClick={() => void find()}>{busy ? t`Predicting…` : t`Predict ${chosen.numeric ? t`from ${figure(chosen.low)} to ${figure(chosen.high)}` : chosen.levels.join(', ')}`}</button>
                    <span class="quiet">{t`It takes about as long as the model did, without its tests. Covariates that are not chosen are at their mean or first level.`}</span>
                </div>
            )}
            {error ? <ProblemBox error={error} /> : null}
        </section>
    );
}

export function Regression({ result }: { result: api.Outputs<'regress'> }) {
    return (
        <>
            <p class="big"><code>{result.formula}</code></p>
            <p class="quiet">{t`${plural(result.subjects, 'subject')}, ${result.exact ? t`all relabellings` : t`${whole(result.permutations ?? 0)} permutations`}, ${result.bootstraps} bootstrap samples.`}</p>
            <Terms result={result} />
            <Predicted process="regress" result={result} />
            <Coefficients result={result} what={t`What a unit moves`} />
        </>
    );
}
