{# Records and arguments in C, and functions that C lacks. #}
{% set least = "static double least(double a, double b) { return b < a ? b : a; }" %}
{% set greatest = "static double greatest(double a, double b) { return b > a ? b : a; }" %}
{% set int_least = "static int int_least(int a, int b) { return b < a ? b : a; }" %}
{% set int_greatest = "static int int_greatest(int a, int b) { return b > a ? b : a; }" %}

{% macro typedef(struct) %}
typedef struct {
{% for field, kind in struct.fields %}
    {{ syntax.type_name(kind) }} {{ syntax.name(field) }};
{% endfor %}
} {{ syntax.type_name(struct) }};
{% endmacro %}

{% macro arguments(names) %}
{% for name in names %}double {{ name }}{{ ", " if not loop.last }}{% endfor %}
{% endmacro %}

{% macro signature(arguments) %}
{% for name, kind in arguments %}
{% if kind is none %}const {{ syntax.prefix }}_parameters *{{ name }}
{%- elif kind.length is defined %}{{ "" if kind.writable else "const " }}double *{{ name }}
{%- else %}{{ syntax.type_name(kind) }} {{ name }}
{%- endif %}{{ ", " if not loop.last }}
{%- else %}void
{%- endfor %}
{%- endmacro %}
