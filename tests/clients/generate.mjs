// Types of the API from its description: node generate.mjs DESCRIPTION OUT. What is binary is a Blob.
import fs from 'node:fs';
import openapiTS, { astToString } from 'openapi-typescript';
import ts from 'typescript';

const blob = ts.factory.createTypeReferenceNode('Blob');
const description = JSON.parse(fs.readFileSync(process.argv[2], 'utf8'));
const ast = await openapiTS(description, {
    transform: (schema) => (schema.format === 'binary' ? blob : undefined),
    emptyObjectsUnknown: true,
});
fs.writeFileSync(process.argv[3], astToString(ast));
