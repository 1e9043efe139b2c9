// Two groups: whether they differ, where, and the way from one mean to the other.
import { useState } from 'preact/hooks';
import * as api from './api';
import { t, whole } from './i18n';
import { Path } from './paths';
import { mayChange, refreshJobs } from './state';
import { Headline, TestedMaps } from './tested';
import { ProblemBox, figure, spread } from './ui';

const BOOTSTRAPS = 500;

/** The geodesic from one mean to the other: both are predictions of a linear model of the labels, so that they are registered to each other. */
function Between({ result }: { result: api.Outputs<'compare-groups'> }) {
    const [path, setPath] = useState<api.Outputs<'geodesic'>>();
    const [size, setSize] = useState<{ r2: number | null; r2Interval?: (number | null)[] }>();
    const [busy, setBusy] = useState(false);
    const [error, setError] = useState<unknown>();
    const given = result.inputs;
    const find = async () => {
        setBusy(true);
        setError(undefined);
        try {
            const model = await api.run('regress', {
                cohort: given.cohort.name, formula: 'shape ~ label', at: result.groups.map((label: string) => ({ label })), permutations: 19, bootstraps: BOOTSTRAPS,
                ...Object.fromEntries(['register', 'commonPose', 'lmax', 'mixedRoutes'].filter((name) => given[name] !== undefined && given[name] !== null).map((name) => [name, given[name]])),
            });
            setSize(model.terms[0] as { r2: number | null; r2Interval?: (number | null)[] });
            const [from, to] = model.predictions.map((p: any) => p.surface.id);
            setPath(await api.run('geodesic', { from, to, register: false }));
            refreshJobs();
        } catch (e) {
            setError(e);
        }
        setBusy(false);
    };
    return (
        <section aria-label={t`Between the means`}>
            <h2>{t`From ${result.groups[0]} to ${result.groups[1]}`}</h2>
            {size && <p>{t`The label is ${figure(100 * (size.r2 ?? NaN))} % of the variance of shape${size.r2Interval ? t` (95 %: ${size.r2Interval.map((v) => figure(100 * (v ?? NaN))).join(' to ')} %, ${BOOTSTRAPS} bootstraps)` : ''}.`}</p>}
            {path ? <Path surfaces={path.surfaces} texts={path.times.map((at: number) => (at === 0 ? t`mean of ${result.groups[0]}` : at === 1 ? t`mean of ${result.groups[1]}` : t`${Math.round(100 * at)} % of the way`))} energies={path.relativeEnergies.geodesic} />
                : <div class="no-report"><p class="quiet">{t`The geodesic between both means, as an animation, and the size of the effect with its interval. It takes about as long as the comparison did.`}</p>
                    {mayChange() && <button disabled={busy} onClick={() => void find()}>{busy ? t`Computing the path…` : t`Path between the means`}</button>}</div>}
            {error ? <ProblemBox error={error} /> : null}
        </section>
    );
}

export function Groups({ result }: { result: api.Outputs<'compare-groups'> }) {
    const sizes: number[] = result.groupSizes?.subjects ?? [];
    const flips = result.exact ? t`all relabellings` : t`${whole(result.permutations ?? 0)} permutations`;
    return (
        <>
            <Headline test={result} against={`${flips}${result.regressedOut?.length ? t`, ${result.regressedOut.join(', ')} regressed out` : ''}`} />
            <p>{t`${result.groups?.join(' against ')}${sizes.length ? t` (${sizes.join(' and ')} subjects)` : ''}, distance of the means ${spread(result.distance, result.distanceInterval)}.`}</p>
            <TestedMaps surface={result.surface.id} test={result} beside={[{ name: 'normalEffect', text: t`difference outwards` }, { name: 'effect', text: t`length of the difference` }]} />
            <p class="quiet">{t`Outwards is positive: there ${result.groups?.[1]} lies farther out than ${result.groups?.[0]}. Lengths are those of surfaces of area 1.`}</p>
            {result.inputs?.cohort?.name && result.groups?.length === 2 && <Between result={result} />}
        </>
    );
}
