// values.cjs - values from JSON Schemas, as arbitraries of fast-check: those that fit, and bent ones.
//
// fitting(schema) draws a value that keeps to type, enum, const, pattern, ranges, required,
// additionalProperties, items, oneOf and anyOf (other keywords are not read; whoever asks judges the
// value afterwards). Where a pattern is that of an identifier, one that is alive is drawn by preference:
// pool(prefix) gives them. bent(value) changes one place of a value: something is taken away, added or
// put in the place of something else.
'use strict';

const ARRAY_MAX = 4;
const DEPTH_MAX = 6;
const ID_PATTERN = /^\^\(?((?:surf|mesh|model|job)(?:\|(?:surf|mesh))?)\)?-/;

function makeValues(fc, resolve, pool) {
    const json = fc.jsonValue({ maxDepth: 2 });
    const awkward = fc.constantFrom(
        null, true, 0, -1, 1, 0.5, 1e308, -1e308, 5e-324, 2 ** 31, 2 ** 53, -(2 ** 63), '', '\u0000', '..',
        'auto', 'mesh-', 'x'.repeat(5000), '\ud83d\ude00', [], {}, [[]], [null], { '': '' },
        { __proto__x: 1 }, 'surf-' + '0'.repeat(32), 'mesh-' + 'f'.repeat(32)
    );
    const anything = fc.oneof(awkward, json);

    function identifiers(pattern) {
        const match = ID_PATTERN.exec(pattern);
        return match ? match[1].split('|').flatMap(pool) : [];
    }

    function text(schema) {
        if (schema.pattern) {
            const alive = identifiers(schema.pattern);
            const any = fc.stringMatching(new RegExp(schema.pattern));
            return alive.length
                ? fc.oneof({ weight: 9, arbitrary: fc.constantFrom(...alive) }, { weight: 1, arbitrary: any })
                : any;
        }
        return fc.fullUnicodeString({ minLength: schema.minLength || 0, maxLength: Math.min(schema.maxLength || 40, 60) });
    }

    function number(schema) {
        const min = schema.minimum ?? -1e6;
        const max = schema.maximum ?? 1e6;
        if (schema.type === 'integer') {
            const low = Math.ceil(min);
            // Small numbers mostly: large ones cost the service time, not wits.
            return fc.oneof(
                { weight: 4, arbitrary: fc.integer({ min: low, max: Math.min(max, low + 8) }) },
                { weight: 1, arbitrary: fc.integer({ min: low, max }) }
            );
        }
        return fc.oneof(fc.double({ min, max, noNaN: true }), fc.constantFrom(min, max));
    }

    function object(schema, depth) {
        const members = Object.fromEntries((schema.required || []).map((name) => [name, json]));
        for (const [name, of] of Object.entries(schema.properties || {})) {
            members[name] = fitting(of, depth + 1);
        }
        const known = fc.record(members, { requiredKeys: schema.required || [] });
        if (schema.additionalProperties === undefined || schema.additionalProperties === false) {
            return known;
        }
        const free = typeof schema.additionalProperties === 'object' ? schema.additionalProperties : {};
        return fc
            .tuple(known, fc.dictionary(fc.string({ maxLength: 8 }), fitting(free, depth + 1), { maxKeys: 3 }))
            .map(([a, b]) => ({ ...b, ...a }));
    }

    function array(schema, depth) {
        const least = schema.minItems || 0;
        return fc.array(fitting(schema.items || {}, depth + 1), {
            minLength: least,
            maxLength: Math.max(least, Math.min(schema.maxItems ?? ARRAY_MAX, least + ARRAY_MAX)),
        });
    }

    function fitting(node, depth = 0) {
        const schema = resolve(node);
        if (schema.const !== undefined) {
            return fc.constant(schema.const);
        }
        if (schema.enum) {
            return fc.constantFrom(...schema.enum);
        }
        const branches = schema.oneOf || schema.anyOf;
        if (branches) {
            return fc.oneof(...branches.map((branch) => fitting(branch, depth + 1)));
        }
        if (Array.isArray(schema.type)) {
            return fc.oneof(...schema.type.map((type) => fitting({ ...schema, type }, depth)));
        }
        switch (schema.type) {
        case 'object':
            return object(schema, depth);
        case 'array':
            return depth > DEPTH_MAX ? fc.constant([]) : array(schema, depth);
        case 'string':
            return text(schema);
        case 'integer':
        case 'number':
            return number(schema);
        case 'boolean':
            return fc.boolean();
        case 'null':
            return fc.constant(null);
        default:
            return json;
        }
    }

    // Every place of a value that can be changed: [holder, key].
    function places(value, found = []) {
        for (const key of value && typeof value === 'object' ? Object.keys(value) : []) {
            found.push([value, key]);
            places(value[key], found);
        }
        return found;
    }

    function bent(g, original) {
        const value = structuredClone(original);
        const all = places(value);
        if (all.length === 0 || g(fc.integer, { min: 0, max: 9 }) === 0) {
            return g(() => anything);
        }
        const [holder, key] = g(() => fc.constantFrom(...all));
        switch (g(() => fc.constantFrom('remove', 'replace', 'replace', 'add', 'wrap'))) {
        case 'remove':
            if (Array.isArray(holder)) {
                holder.splice(Number(key), 1);
            } else {
                delete holder[key];
            }
            break;
        case 'replace':
            holder[key] = g(() => anything);
            break;
        case 'add':
            if (Array.isArray(holder)) {
                holder.push(g(() => anything));
            } else {
                holder[g(fc.string, { minLength: 1, maxLength: 12 })] = g(() => anything);
            }
            break;
        default:
            holder[key] = [holder[key]];
        }
        return value;
    }

    return { fitting, bent, anything };
}

module.exports = { makeValues };
