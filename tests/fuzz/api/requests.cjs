// requests.cjs - one request to an operation, drawn from a generator, and what is known of it.
//
// Each part is drawn from its schema and, in one request of two, one part is bent: a path, a query or
// header parameter, the body's media type, its JSON, or its bytes. What was drawn is then judged again by the
// schemas, since what is bent may still fit: "wrong" holds the reasons for which the service has to refuse
// the request, and is empty where it may take it. Meshes and arrays are bytes to the description, so that
// nothing is known of those that are bent.
'use strict';

const JSON_TYPE = 'application/json';

function makeRequests(fc, description, values, samples) {
    const { fault, textual, schemas } = description;

    function parameterText(g, parameter) {
        return String(g(() => values.fitting(parameter.schema)));
    }

    function strangeText(g) {
        return g(() =>
            fc.oneof(
                fc.constantFrom('', '-1', '0', '1e9', '99999999999999999999', 'null', '..', '%', 'a b', '\u0000', 'x'.repeat(300)),
                fc.string({ maxLength: 20 }),
                fc.fullUnicodeString({ maxLength: 8 })
            )
        );
    }

    function parameters(g, operation, bend) {
        const drawn = [];
        const bendable = operation.parameters;
        const target = bend && bendable.length ? g(() => fc.constantFrom(...bendable)) : null;
        for (const parameter of operation.parameters) {
            // Without a preference an execution waits for its job: that is for the few.
            const often = parameter.name === 'Prefer' ? 7 : 2;
            const chosen = (g(fc.integer, { min: 0, max: often }) === 0) === (often === 2);
            const wanted = parameter.required || parameter === target || chosen;
            if (wanted) {
                const text = parameter === target ? strangeText(g) : parameterText(g, parameter);
                drawn.push({ parameter, text });
            }
        }
        return drawn;
    }

    function execution(g, drawn) {
        const process = drawn.find((one) => one.parameter.in === 'path').text;
        const schema = schemas[`${process}Inputs`];
        return { inputs: schema ? g(() => values.fitting(schema)) : {} };
    }

    // Bodies of JSON: what fits, sometimes bent, sometimes with a damage to its very bytes.
    function jsonBody(g, operation, drawn, bend) {
        const known = samples.json[operation.id];
        let value;
        if (operation.id === 'execute') {
            value = execution(g, drawn);
        } else if (known && g(fc.boolean)) {
            value = g(() => fc.constantFrom(...known()));
        } else {
            value = g(() => values.fitting(operation.body[JSON_TYPE]));
        }
        if (bend) {
            value = values.bent(g, value);
        }
        let text = JSON.stringify(value);
        if (bend && g(fc.integer, { min: 0, max: 3 }) === 0) {
            text = g(() =>
                fc.constantFrom(
                    text.slice(0, -1), text + text, text.replace(/[0-9]+/, '1e999'), text.replace(/[0-9]+/, 'NaN'),
                    text.replace('{', '{"inputs":1,"inputs":{},'), '\ufeff' + text, '['.repeat(3000) + ']'.repeat(3000),
                    text.replace('"', '"\\ud800'), text.replace('"', '"\\u0000'), ''
                )
            );
        }
        return Buffer.from(text);
    }

    function rawBody(g, type, bend) {
        const whole = g(() => fc.constantFrom(...(type === 'application/x-npy' ? samples.npy : samples.meshes)));
        if (!bend) {
            return whole;
        }
        const bytes = Buffer.from(whole);
        const times = g(fc.integer, { min: 1, max: 8 });
        for (let i = 0; i < times; i++) {
            bytes[g(fc.integer, { min: 0, max: bytes.length - 1 })] = g(fc.integer, { min: 0, max: 255 });
        }
        return bytes.subarray(0, g(fc.integer, { min: 0, max: bytes.length }));
    }

    function body(g, operation, drawn, bend, request) {
        const types = Object.keys(operation.body);
        request.type = g(() => fc.constantFrom(...types));
        request.body = request.type === JSON_TYPE ? jsonBody(g, operation, drawn, bend) : rawBody(g, request.type, bend);
        if (bend && g(fc.integer, { min: 0, max: 7 }) === 0) {
            request.type = g(() => fc.constantFrom('image/png', 'text/html', 'application/jsonx', 'a'));
            request.wrong.push(`media type ${request.type}`);
        }
        if (request.type !== JSON_TYPE) {
            return;
        }
        let value;
        try {
            value = JSON.parse(request.body.toString());
        } catch {
            request.wrong.push('no JSON');
            return;
        }
        const reason = fault(operation.body[JSON_TYPE], value);
        const process = operation.id === 'execute' ? schemas[`${drawn[0].text}Inputs`] : null;
        const other = !reason && process ? fault(process, value.inputs) : null;
        if (reason || other) {
            request.wrong.push(`body: ${reason || other}`);
        }
    }

    function judge(drawn, request) {
        for (const { parameter, text } of drawn) {
            // A preference or an event that is not understood is passed over, as their standards say.
            const lenient = parameter.in === 'header' && parameter.schema.maxLength === undefined;
            const reason = lenient ? null : fault(parameter.schema, textual(parameter.schema, text));
            if (reason) {
                request.wrong.push(`${parameter.in} ${parameter.name}: ${reason}`);
            }
        }
    }

    function headers(g, drawn, request) {
        for (const { parameter, text } of drawn.filter((one) => one.parameter.in === 'header')) {
            // What no client can send in a header is left out here; tests/http has it.
            const printable = text.replace(/[^\x21-\x7e]/g, '');
            request.headers[parameter.name] =
                parameter.name === 'Prefer' ? samples.prefer(g, printable)
                : /^If-/.test(parameter.name) ? g(() => fc.constantFrom('*', '*', samples.etag() || '"x"', printable))
                : printable;
        }
        if (g(fc.integer, { min: 0, max: 7 }) === 0) {
            request.headers.Accept = g(() =>
                fc.constantFrom('*/*', 'application/json', 'application/x-npy', 'text/csv;q=0.5, */*;q=0.1', 'image/png', ';;,')
            );
        }
        if (g(fc.integer, { min: 0, max: 9 }) === 0) {
            request.headers['If-None-Match'] = g(() => fc.constantFrom('*', '"x"', samples.etag() || '""', 'W/'));
        }
    }

    // g: of fc.gen(); the operation is drawn by the caller.
    function draw(g, operation) {
        const bend = g(fc.boolean);
        const part = bend ? g(() => fc.constantFrom(...(operation.body ? ['body', 'body', 'parameter'] : ['parameter']))) : null;
        const drawn = parameters(g, operation, part === 'parameter');
        const request = { operation, method: operation.method, headers: {}, wrong: [], body: null, type: null };

        // An empty part of a path leads to another route, where there is one.
        for (const one of drawn.filter((of) => of.parameter.in === 'path' && of.text === '')) {
            one.text = ' ';
        }
        request.values = Object.fromEntries(drawn.map((one) => [one.parameter.name, one.text]));
        headers(g, drawn, request);
        for (const one of drawn.filter((of) => of.parameter.in === 'header' && of.parameter.name !== 'Prefer')) {
            one.text = request.headers[one.parameter.name];
        }
        judge(drawn, request);
        if (operation.body) {
            body(g, operation, drawn, part === 'body', request);
        }
        const query = drawn
            .filter((one) => one.parameter.in === 'query')
            .map((one) => `${one.parameter.name}=${encodeURIComponent(one.text)}`);
        if (part === 'parameter' && g(fc.integer, { min: 0, max: 5 }) === 0) {
            query.push('nosuch=1');
            request.wrong.push('a query parameter that is not described');
        }
        request.path = drawn
            .filter((one) => one.parameter.in === 'path')
            .reduce((path, one) => path.replace(`{${one.parameter.name}}`, () => encodeURIComponent(one.text)), operation.path);
        if (query.length) {
            request.path += `?${query.join('&')}`;
        }
        return request;
    }

    return { draw };
}

module.exports = { makeRequests };
