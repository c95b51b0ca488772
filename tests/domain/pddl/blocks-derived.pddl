; clear, above and handempty follow from on and holding
(define (domain blocks-derived)
  (:requirements :strips :typing :derived-predicates :existential-preconditions
                 :negative-preconditions)
  (:types block)
  (:predicates (on ?x ?y - block) (ontable ?x - block) (holding ?x - block)
               (clear ?x - block) (above ?x ?y - block) (handempty))
  (:derived (clear ?b - block)
    (and (not (exists (?z - block) (on ?z ?b))) (not (holding ?b))))
  (:derived (above ?a ?b - block)
    (or (on ?a ?b) (exists (?x - block) (and (on ?a ?x) (above ?x ?b)))))
  (:derived (handempty) (not (exists (?z - block) (holding ?z))))
  (:action pick-up
    :parameters (?x - block)
    :precondition (and (clear ?x) (ontable ?x) (handempty))
    :effect (and (not (ontable ?x)) (holding ?x)))
  (:action put-down
    :parameters (?x - block)
    :precondition (holding ?x)
    :effect (and (not (holding ?x)) (ontable ?x)))
  (:action stack
    :parameters (?x ?y - block)
    :precondition (and (holding ?x) (clear ?y))
    :effect (and (not (holding ?x)) (on ?x ?y)))
  (:action unstack
    :parameters (?x ?y - block)
    :precondition (and (on ?x ?y) (clear ?x) (handempty))
    :effect (and (holding ?x) (not (on ?x ?y)))))
