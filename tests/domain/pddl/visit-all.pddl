(define (domain visit-all)
  (:requirements :typing)
  (:types place)
  (:predicates (connected ?x ?y - place) (at-robot ?x - place) (visited ?x - place))
  (:action move
    :parameters (?from ?to - place)
    :precondition (and (at-robot ?from) (connected ?from ?to))
    :effect (and (not (at-robot ?from)) (at-robot ?to) (visited ?to))))
