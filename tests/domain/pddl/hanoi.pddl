(define (domain hanoi)
  (:requirements :strips :negative-preconditions :equality)
  (:predicates (clear ?x) (on ?x ?y) (smaller ?x ?y) (disc ?x))
  (:action move
    :parameters (?disc ?from ?to)
    :precondition (and (disc ?disc) (smaller ?to ?disc) (on ?disc ?from) (clear ?disc) (clear ?to)
                       (not (= ?from ?to)))
    :effect (and (clear ?from) (on ?disc ?to) (not (on ?disc ?from)) (not (clear ?to)))))
