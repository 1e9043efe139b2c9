/*
 * schemas_quality.c - the inputs and outputs of evaluate-model and compare-groups as JSON
 * Schema (2020-12). As schemas.c.
 */
#include "api/cohorts.h"
#include "toolkit/schemas.h"

#define COVARIATES_MAX_TEXT PROCESS_TEXT(COHORT_COVARIATES_MAX)
#define PERMUTATIONS_DEFAULT_TEXT PROCESS_TEXT(PROCESS_PERMUTATIONS_DEFAULT)
#define SAMPLES_DEFAULT_TEXT PROCESS_TEXT(PROCESS_QUALITY_SAMPLES_DEFAULT)
#define SAMPLES_MAX_TEXT PROCESS_TEXT(PROCESS_QUALITY_SAMPLES_MAX)

#define METHOD                                                               \
    ",\"method\":{\"enum\":[\"srnf\"],\"default\":\"srnf\",\"description\":" \
    "\"srnf: of the space of SRNFs, in which components are straight lines.\"}"

/* Of the mean that both begin with. */
#define MEAN_MEMBERS                                                                            \
    "\"iterations\":{\"type\":\"integer\",\"description\":\"Of the mean.\"},\"converged\":{"    \
    "\"type\":\"boolean\"},\"history\":{\"type\":\"array\",\"description\":\"As in mean.\"},"   \
    "\"relativeEnergy\":{\"type\":[\"number\",\"null\"],\"description\":\"What is lost of the " \
    "mean SRNF by being that of a surface.\"},\"seconds\":{\"type\":[\"number\",\"null\"],"     \
    "\"description\":\"Of the mean.\"}," BRIDGED_GROUP REGISTRATION

const char evaluate_inputs_schema[] = INPUTS_OPENING
    "\"required\":[],\"properties\":{\"model\":{"
    "\"type\":[\"string\",\"null\"],\"pattern\":\"" PROCESS_MODEL_PATTERN
    "\",\"description\":\"A model that keeps all of its components; or surfaces or a cohort "
    "instead, with the options of their mean.\"},\"surfaces\":{\"type\":[\"array\",\"null\"],"
    "\"minItems\":3,\"maxItems\":" GROUP_MAX_TEXT
    ",\"items\":{\"type\":\"string\",\"pattern\":\"" PROCESS_SURFACE_PATTERN
    "\"},\"description\":\"The surfaces. Meshes are encoded with the default options.\"},"
    "\"cohort\":{\"type\":[\"string\",\"null\"],\"pattern\":\"" COHORT_NAME_PATTERN
    "\",\"description\":\"Name of a cohort, instead of surfaces.\"}," MIXED_ROUTES_INPUT
    "," MEAN_INPUTS METHOD
    ",\"components\":{\"type\":[\"integer\",\"null\"],\"exclusiveMinimum\":0,"
    "\"default\":null,\"description\":\"The curves run from 1 to this; at most two less than "
    "there are surfaces, fewer where subjects are repeated. null: 10 or what there "
    "is.\"},\"samples\":{\"type\":\"integer\","
    "\"minimum\":2,\"maximum\":" SAMPLES_MAX_TEXT ",\"default\":" SAMPLES_DEFAULT_TEXT
    ",\"description\":\"Drawn for the specificity.\"},\"seed\":{\"type\":\"integer\","
    "\"minimum\":0,\"maximum\":" SEED_MAX_TEXT
    ",\"default\":0,\"description\":\"Of the samples.\"}}}";

const char evaluate_outputs_schema[] = OUTPUTS_OPENING
    "\"members\":{\"type\":\"integer\"},\"subjects\":{\"type\":\"integer\",\"description\":"
    "\"Members without a subject are subjects of their own.\"},\"compactness\":{\"type\":\"array\","
    "\"description\":\"[{components, value, standardError}]: share of the variance in the first "
    "components.\"},\"generalisation\":{\"type\":\"array\",\"description\":\"[{components, value, "
    "standardError, elastic, elasticStandardError}]: distance of a member, whose subject is left "
    "out, from its reconstruction, averaged; standard errors allow for dependence within "
    "subjects. value is the surface distance: root of the mean square "
    "distance of corresponding points, by area, for surfaces of area 1; elastic is the L2 "
    "distance of SRNFs.\"},\"specificity\":{\"type\":\"array\",\"description\":\"The same "
    "members: distance of a sample from the nearest subject, averaged.\"},\"refitted\":{"
    "\"type\":\"array\",\"description\":\"What is fitted again without the subject that is left "
    "out.\"},\"shared\":{\"type\":\"array\",\"description\":\"What is not: the registration is "
    "that of all.\"}," MEAN_MEMBERS MADE_BY;

const char compare_inputs_schema[] = INPUTS_OPENING
    "\"required\":[\"cohort\"],\"properties\":{\"cohort\":{"
    "\"type\":\"string\",\"pattern\":\"" COHORT_NAME_PATTERN
    "\",\"description\":\"A cohort whose members have two labels, the same for all members of a "
    "subject.\"}," MIXED_ROUTES_INPUT ",\"covariates\":{"
    "\"type\":\"array\",\"maxItems\":" COVARIATES_MAX_TEXT
    ",\"items\":{\"type\":\"string\"},\"default\":[],\"description\":\"Names of covariates of the "
    "members, numbers or true and false, whose linear effect is taken out.\"},\"permutations\":{"
    "\"type\":\"integer\",\"minimum\":1,\"maximum\":" PERMUTATIONS_MAX_TEXT
    ",\"default\":" PERMUTATIONS_DEFAULT_TEXT
    ",\"description\":\"Of the labels of whole subjects. No p can be below 1 / (permutations + "
    "1).\"},\"seed\":{"
    "\"type\":\"integer\",\"minimum\":0,\"maximum\":" SEED_MAX_TEXT
    ",\"default\":0,\"description\":\"Of the permutations.\"}," MEAN_INPUTS METHOD "}}";

const char compare_outputs_schema[] = OUTPUTS_OPENING
    "\"pValue\":{\"type\":\"number\",\"description\":\"Permutation p of the "
    "distance between the groups' "
    "means.\"},\"members\":{\"type\":\"integer\"},\"subjects\":{\"type\":\"integer\","
    "\"description\":\"What "
    "is compared: the members of each are "
    "averaged.\"},\"groupSizes\":{\"type\":\"object\",\"description\":\"members and subjects of "
    "each group.\"},\"pValueIsFloor\":{\"type\":\"boolean\",\"description\":\"Whether pValue is "
    "the smallest that the test can "
    "give; that of the map may be smaller, with "
    "covariates.\"},\"pValueInterval\":{\"type\":\"array\",\"description\":\"Wilson's 95 % "
    "interval of "
    "the p that all relabellings would give; the point itself where "
    "exact.\"},\"leastSignificanceIsFloor\":{\"type\":\"boolean\",\"description\":\"As of "
    "pValue.\"},\"leastSignificanceInterval\":{\"type\":\"array\",\"description\":\"As of "
    "pValue.\"},\"distance\":{\"type\":\"number\","
    "\"description\":\"That distance, in the L2 norm of SRNFs, without the covariates' "
    "part.\"},\"leastSignificance\":{\"type\":\"number\",\"description\":\"Least value of "
    "significance on the map: p of the hypothesis that the groups differ nowhere.\"},"
    "\"leastFdr\":{\"type\":\"number\",\"description\":\"Least value of fdr on the map: the false "
    "discovery rate of the node with the clearest difference.\"},\"largestEffect\":{\"type\":"
    "\"number\",\"description\":\"Largest value of effect on the map: how far the groups' mean "
    "surfaces are apart at a node, in the coordinates of the mean surface as "
    "stored.\"},\"groups\":{"
    "\"type\":\"array\",\"description\":\"The two labels; effects go from the first to the "
    "second.\"},\"permutations\":{\"type\":\"integer\",\"description\":\"Relabellings that the "
    "observed labels were compared with; 0: "
    "none.\"},\"relabellings\":{\"type\":[\"number\",\"null\"],\"description\":\"Different ones "
    "that whole subjects can have, the observed among them: those give some subject another group "
    "or other covariates; null: no test, or beyond all "
    "numbers.\"},\"exact\":{\"type\":[\"boolean\",\"null\"],\"description\":\"Whether all of "
    "them were taken, each once, since there were no more than asked for: p is then that of all, "
    "not estimated; null: no test.\"},\"level\":{\"enum\":[\"exact\",\"asymptotic\"],"
    "\"description\":\"exact: labels of subjects can be exchanged, so that where groups do not "
    "differ p is at most a with a probability of at most a. asymptotic: covariates are regressed "
    "out (Freedman and Lane 1983), with which that holds in the limit of many subjects only, even "
    "if all relabellings were taken.\"},\"regressedOut\":{\"type\":\"array\","
    "\"description\":\"Names of the covariates.\"},\"map\":{\"type\":\"object\","
    "\"description\":\"On the nTheta x nPhi Gauss-Legendre grid, row by row. significance: "
    "permutation p of the local difference (Hotelling's T2 of the displacements), corrected for "
    "all points by the largest statistic; fdr: least false discovery rate, by area, at which the "
    "point is reported; effect: length of the mean displacement, for surfaces of area 1.\"},"
    "\"surface\":{\"type\":\"object\",\"description\":\"Record of the mean surface; its meshes "
    "carry significance, fdr, effect, normalEffect (outward positive), pointwiseP and statistic "
    "at every vertex.\"}," MEAN_MEMBERS MADE_BY;
